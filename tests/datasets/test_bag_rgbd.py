"""RGB-D in bags that others made: millimetres, other frames and lenses, depth that is not aligned."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from rosbags.typesys import Stores

from taskslam.datasets.bag import Bag
from taskslam.datasets.bag_access import ros_types
from taskslam.datasets.bag_rgbd import depth_of, nearest
from taskslam.datasets.bag_sensor import frames_of, messages_of
from taskslam.datasets.euroc_writer import EurocWriter
from taskslam.datasets.opening import open_dataset
from taskslam.datasets.ros_encoding import RosEncoder
from taskslam.errors import DatasetError
from taskslam.measurements import Sensor

COLOR, INFO = "/camera/color/image_raw", "/camera/color/camera_info"
DEPTH = "/camera/aligned_depth_to_color/image_raw"
RGBD = frozenset({Sensor.RGBD_IMAGES})


@pytest.fixture
def make_bag(tmp_path, recorded):
    """An MCAP with mounts and RGB-D images alone; edit(topic, message) changes messages, names renames topics."""

    def make(edit=lambda topic, message: None, names=None) -> Path:
        store = ros_types(Stores.ROS2_HUMBLE)
        encoder = RosEncoder(store)
        with Rosbag2Writer(tmp_path / "rgbd", version=8, storage_plugin=StoragePlugin.MCAP) as writer:
            connections = {}
            said = [
                item
                for item in encoder.opening(0, frames_of(recorded.robot.rig), recorded.robot)
                if item[0] == "/tf_static"
            ]
            for measurement in recorded.of(RGBD):
                said += messages_of(encoder, recorded.robot.rig, measurement)
            for topic, stamp, message in said:
                edit(topic, message)
                name, kind = (names or {}).get(topic, topic), message.__msgtype__
                connections[name] = connections.get(name) or writer.add_connection(name, kind, typestore=store)
                writer.write(connections[name], stamp, store.serialize_cdr(message, kind))
        return tmp_path / "rgbd"

    return make


def test_a_strangers_millimetres_are_metres(make_bag, recorded):
    def in_millimetres(topic, message):
        if topic == DEPTH:
            metres = np.nan_to_num(message.data.view(np.float32))
            message.encoding, message.step = "16UC1", message.width * 2
            message.data = np.round(metres * 1000).astype("<u2").view(np.uint8)

    dataset = open_dataset(make_bag(in_millimetres))
    camera, sent = dataset.rig.rgbd, recorded.of(RGBD)
    assert dataset.sensors == RGBD
    assert camera.focal_length == pytest.approx(recorded.robot.rig.rgbd.focal_length)
    assert np.allclose(camera.mount.matrix(), recorded.robot.rig.rgbd.mount.matrix())
    assert (camera.rate, camera.color) == (pytest.approx(20.0), True)
    back = list(dataset.measurements(RGBD))
    assert len(back) == len(sent) > 10
    for one, other in zip(back, sent, strict=True):
        np.testing.assert_array_equal(one.image, other.image)
        assert np.abs(one.depth - other.depth).max() < 1e-6  # it was measured in whole millimetres
        assert one.depth.dtype == np.float32


def test_a_lens_of_its_own_is_taken_out_and_depths_are_never_blended(make_bag, recorded):
    def off_centre(topic, message):
        if topic == INFO:
            message.k = message.k + np.array([0, 0, 3.0, 0, 0, 0, 0, 0, 0])

    dataset = open_dataset(make_bag(off_centre))
    one, sent = next(dataset.measurements(RGBD)), recorded.of(RGBD)[0]
    np.testing.assert_array_equal(one.depth[:, :-3], sent.depth[:, 3:])
    np.testing.assert_array_equal(one.image[:, :-3], sent.image[:, 3:])
    assert not one.depth[:, -3:].any()


@pytest.mark.parametrize(
    ("names", "topics", "complaint"),
    [
        ({DEPTH: "/camera/depth/image_rect_raw"}, {}, ""),
        ({COLOR: "/camera/rgb/image", INFO: "/camera/rgb/camera_info"}, {}, ""),
        ({COLOR: "/front"}, {}, None),
        ({COLOR: "/front"}, {"color": "/front"}, "no /camera_info, so their camera cannot be told"),
    ],
)
def test_topics_are_known_by_their_names(make_bag, names, topics, complaint):
    dataset = open_dataset(make_bag(names=names), topics=topics)
    assert dataset.sensors == (RGBD if complaint == "" else frozenset())
    assert (complaint or "") in dataset.why_not.get(Sensor.RGBD_IMAGES, "")


def test_depth_of_another_size_is_not_aligned(make_bag):
    def halved(topic, message):
        if topic == DEPTH:
            message.height //= 2
            message.data = message.data[: message.height * message.step]

    assert "depth that is aligned to them" in open_dataset(make_bag(halved)).why_not[Sensor.RGBD_IMAGES]


def message(**values):
    depth = np.array([[1.0, np.nan], [0.0, np.inf]], np.float32)
    size = {"height": 2, "width": 2, "step": 8, "data": depth.view(np.uint8).ravel()}
    return SimpleNamespace(**{"encoding": "32FC1", "is_bigendian": 0} | size | values)


def test_what_was_not_measured_is_zero():
    assert depth_of(message()).tolist() == [[1.0, 0.0], [0.0, 0.0]]
    big = np.array([[1500, 0], [7, 65535]], ">u2").view(np.uint8).ravel()
    assert depth_of(message(encoding="16UC1", is_bigendian=1, step=4, data=big)) == pytest.approx(
        np.array([[1.5, 0.0], [0.007, 65.535]])
    )


@pytest.mark.parametrize("wrong", [{"encoding": "mono8"}, {"step": 7}, {"height": 3}, {"width": 0}])
def test_depth_that_cannot_be_is_refused(wrong):
    with pytest.raises(DatasetError):
        depth_of(message(**wrong))


def test_the_nearest_depth_counts():
    depth = np.array([[1.0, 2.0], [3.0, 4.0]], np.float32)
    table = np.array([[[0.4, 0.0], [0.6, 0.4]], [[-0.6, 1.0], [np.nan, np.nan]]], np.float32)
    assert nearest(depth, table).tolist() == [[1.0, 2.0], [0.0, 0.0]]


def test_an_euroc_folder_cannot_hold_it(tmp_path, recorded):
    with pytest.raises(DatasetError, match="not rgbd_images; write rosbag1, rosbag2 or mcap"):
        EurocWriter(tmp_path, recorded.robot, RGBD)


def test_our_bag_gives_the_robots_own_camera_back(bag, recorded):
    dataset = open_dataset(bag)
    assert isinstance(dataset, Bag)
    assert dataset.rig.rgbd == recorded.robot.rig.rgbd
