from __future__ import annotations

import os
import shutil
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_types_from_msg

from taskslam.datasets.bag import Bag
from taskslam.datasets.bag_access import ros_types
from taskslam.datasets.bag_sensor import frames_of, messages_of
from taskslam.datasets.opening import open_dataset
from taskslam.datasets.ros_encoding import RosEncoder
from taskslam.errors import DatasetError
from taskslam.measurements import Sensor
from taskslam.robot import load_robot
from taskslam.sensors import fitted

SENSORS = frozenset(fitted(load_robot("turtlebot2_d435i").rig))


def opened(path: Path, **topics: str) -> Bag:
    dataset = open_dataset(path, topics=topics)
    assert isinstance(dataset, Bag)
    return dataset


def test_what_was_written_comes_back_bit_for_bit(bag, recorded, is_same):
    dataset = opened(bag)
    assert dataset.sensors == SENSORS
    assert dataset.rig == recorded.robot.rig
    back = list(dataset.measurements(SENSORS))
    assert len(back) == len(recorded.measurements)
    assert all(map(is_same, recorded.measurements, back))
    assert not dataset.skipped


def test_the_truth_comes_back_bit_for_bit(bag, recorded):
    back = [(pose.stamp, pose.T_world_base.tolist()) for pose in opened(bag).truth()]
    assert back == [(stamp, at.matrix().tolist()) for stamp, at in recorded.truth]


def test_the_truth_is_no_sensor(bag):
    assert opened(bag)._topics["wheel_odometry"] == "/odom"


def test_without_our_robot_the_rig_follows_from_the_messages(bag, recorded, monkeypatch):
    monkeypatch.setattr(Bag, "_own_robot", lambda self: None)
    dataset, rig = opened(bag), recorded.robot.rig
    assert dataset.sensors == SENSORS
    assert np.allclose(dataset.rig.lidar_2d.mount.matrix(), rig.lidar_2d.mount.matrix())
    assert np.allclose(dataset.rig.lidar_2d.angles(), rig.lidar_2d.angles(), atol=1e-6)
    assert dataset.rig.lidar_2d.rate == pytest.approx(rig.lidar_2d.rate)
    assert dataset.rig.lidar_3d.rings == 4
    assert np.allclose(dataset.rig.lidar_3d.mount.matrix(), rig.lidar_3d.mount.matrix())
    assert dataset.rig.imu.gyro_noise == pytest.approx(rig.imu.gyro_noise)
    assert dataset.rig.stereo.focal_length == pytest.approx(rig.stereo.focal_length)
    assert dataset.rig.stereo.baseline == pytest.approx(rig.stereo.baseline)
    assert np.allclose(dataset.rig.stereo.mount.matrix(), rig.stereo.mount.matrix())
    pairs = list(dataset.measurements({Sensor.STEREO_IMAGES}))
    assert all(
        np.array_equal(pair.left, sent.left)
        for pair, sent in zip(pairs, recorded.of(frozenset({Sensor.STEREO_IMAGES})), strict=True)
    )


def test_reading_stops_with_one_sentence_wherever_a_bag_is_cut_off(bag, recorded, tmp_path):
    size = max(file.stat().st_size for file in [bag, *bag.rglob("*")] if file.is_file())
    for share in (0.0, 0.001, 0.3, 0.7, 0.999):
        copy = tmp_path / f"{share}" / bag.name
        copy.parent.mkdir()
        if bag.is_dir():
            shutil.copytree(bag, copy)
        else:
            shutil.copy(bag, copy)
        file = max((f for f in [copy, *copy.rglob("*")] if f.is_file()), key=lambda f: f.stat().st_size)
        with file.open("r+b") as handle:
            handle.truncate(round(size * share))
        back, complaint = [], ""
        try:
            back = list(opened(copy).measurements(SENSORS))
        except DatasetError as error:
            complaint = str(error)
        if back:  # the end of an SQLite file may be an index that nobody needs
            assert (share, len(back)) == (0.999, len(recorded.measurements))
        else:
            assert copy.name in complaint
            assert len(complaint) < 500


def test_flipped_bytes_never_do_worse_than_one_sentence(bag, tmp_path):
    random = np.random.default_rng(0)
    for attempt in range(8):
        copy = tmp_path / f"{attempt}" / bag.name
        copy.parent.mkdir()
        if bag.is_dir():
            shutil.copytree(bag, copy)
        else:
            shutil.copy(bag, copy)
        file = max((f for f in [copy, *copy.rglob("*")] if f.is_file()), key=lambda f: f.stat().st_size)
        data = bytearray(file.read_bytes())
        for place in random.integers(0, len(data), 200):
            data[place] ^= int(random.integers(1, 256))
        file.write_bytes(data)
        try:
            list(opened(copy).measurements(SENSORS))
        except DatasetError:
            continue


Make = Callable[..., Path]


@pytest.fixture
def make_bag(tmp_path: Path, recorded: Any) -> Make:
    """An MCAP with the odometry and scans of the drive on topics of other names, as a stranger would have made it."""

    def make(
        odometry: tuple[str, ...] = ("/odom",), scan: str = "/scan", frames: bool = True, edit: Any = None
    ) -> Path:
        types = ros_types(Stores.ROS2_HUMBLE)
        custom = "nobody_msgs/msg/Known"
        types = type(types)()
        types.register(ros_types(Stores.ROS2_HUMBLE).fielddefs)
        types.register(get_types_from_msg("float64 x", custom))
        encoder = RosEncoder(ros_types(Stores.ROS2_HUMBLE))
        with Rosbag2Writer(tmp_path / "strange", version=8, storage_plugin=StoragePlugin.MCAP) as writer:
            known = writer.add_connection("/custom", custom, typestore=types)
            writer.write(known, 0, types.serialize_cdr(types.types[custom](x=1.0), custom))
            connections: dict[str, Any] = {}

            def say(topic: str, stamp: int, message: Any) -> None:
                kind = message.__msgtype__
                connections[topic] = connections.get(topic) or writer.add_connection(topic, kind, typestore=types)
                writer.write(connections[topic], stamp, types.serialize_cdr(message, kind))

            for topic, stamp, message in encoder.opening(0, frames_of(recorded.robot.rig), recorded.robot):
                if topic == "/tf_static" and frames:
                    say(topic, stamp, message)
            for measurement in recorded.of(frozenset({Sensor.WHEEL_ODOMETRY, Sensor.LASER_SCAN})):
                for topic, stamp, message in messages_of(encoder, recorded.robot.rig, measurement):
                    if edit is not None:
                        edit(topic, message)
                    for name in odometry if topic == "/odom" else (scan,):
                        say(name, stamp, message)
        return tmp_path / "strange"

    return make


def test_types_that_nobody_knows_are_passed_over(make_bag, recorded):
    dataset = opened(make_bag())
    assert dataset.sensors == {Sensor.WHEEL_ODOMETRY, Sensor.LASER_SCAN}
    assert len(list(dataset.measurements(SENSORS))) == 60


def test_several_candidates_are_asked_for_by_name(make_bag):
    path = make_bag(odometry=("/wheels", "/fused"))
    assert "name one, --topic wheel_odometry=TOPIC, of /fused, /wheels" in opened(path).why_not[Sensor.WHEEL_ODOMETRY]
    assert Sensor.WHEEL_ODOMETRY in opened(path, wheel_odometry="/wheels").sensors


@pytest.mark.parametrize(
    ("topics", "complaint"),
    [
        ({"wheels": "/odom"}, "expected one of laser_scan"),
        ({"wheel_odometry": "/nowhere"}, "no such topic; the recording has /custom, /odom"),
        ({"wheel_odometry": "/scan"}, "of the type sensor_msgs/msg/LaserScan; expected nav_msgs/msg/Odometry"),
    ],
)
def test_a_wrong_topic_is_named(make_bag, topics, complaint):
    with pytest.raises(DatasetError, match=complaint):
        opened(make_bag(), **topics)


def test_a_sensor_whose_place_nobody_tells_needs_a_mount(make_bag):
    path = make_bag(frames=False)
    dataset = opened(path)
    assert dataset.sensors == {Sensor.WHEEL_ODOMETRY}
    assert "give --mount laser=x,y,z,roll,pitch,yaw" in dataset.why_not[Sensor.LASER_SCAN]
    mounted = open_dataset(path, mounts={"laser": "0.1,0,0.2,0,0,1.5"})
    assert mounted.rig.lidar_2d.mount.xyz == (0.1, 0.0, 0.2)
    with pytest.raises(DatasetError, match="expected x,y,z,roll,pitch,yaw"):
        open_dataset(path, mounts={"laser": "0.1,0"})


def test_stamps_decide_the_order_and_late_ones_are_counted(make_bag):
    moved = {"count": 0}

    def edit(topic: str, message: Any) -> None:
        if topic == "/scan":
            moved["count"] += 1
            message.header.stamp.sec += 5 if moved["count"] == 3 else 0

    dataset = opened(make_bag(edit=edit))
    stamps = [measurement.stamp for measurement in dataset.measurements(SENSORS)]
    assert stamps == sorted(stamps)
    assert len(stamps) + dataset.skipped.counts["messages more than a second out of order"] == 60


@pytest.mark.parametrize(
    ("topic", "damage", "complaint"),
    [
        (
            "/odom",
            lambda m: setattr(m.pose.pose.position, "x", float("nan")),
            r"/odom, the message recorded at 0\.020 s",
        ),
        ("/odom", lambda m: setattr(m.pose.pose.orientation, "w", 5.0), "quaternion is not of unit length"),
        ("/odom", lambda m: setattr(m.header.stamp, "sec", -5), "before the beginning of time"),
    ],
)
def test_a_damaged_message_is_named(make_bag, topic, damage, complaint):
    path = make_bag(edit=lambda name, message: damage(message) if name == topic else None)
    with pytest.raises(DatasetError, match=complaint):
        list(opened(path).measurements(SENSORS))


def test_the_real_bags_say_what_they_hold(data):
    nav2 = opened(data / "bags" / "nav2_turtlebot.mcap")
    assert nav2.sensors == {Sensor.WHEEL_ODOMETRY}
    assert len(list(nav2.measurements(SENSORS))) == 2639
    poses = opened(data / "bags" / "ROS_example.bag")
    assert poses.sensors == set()
    assert len(list(poses.truth())) == 12765
    assert opened(data / "bags" / "tf_example").sensors == set()


def test_what_is_no_recording_says_so(tmp_path):
    with pytest.raises(DatasetError, match="no such file or folder"):
        open_dataset(tmp_path / "absent")
    with pytest.raises(DatasetError, match="holds neither mav0"):
        open_dataset(tmp_path)
    (tmp_path / "a.bag").write_bytes(b"")
    (tmp_path / "b.mcap").write_bytes(b"")
    with pytest.raises(DatasetError, match="holds 2 bags"):
        open_dataset(tmp_path)
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(DatasetError, match=r"notes\.txt"):
        open_dataset(tmp_path / "notes.txt")


def test_a_bag_whose_metadata_name_a_pipe_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "drive.db3")
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {relative_file_paths: [drive.db3]}\n")
    with pytest.raises(DatasetError, match=r"drive\.db3: cannot read the bag: found a pipe or a device"):
        open_dataset(tmp_path)


def test_a_length_beyond_the_end_of_the_file_allocates_nothing(tmp_path):
    path = tmp_path / "drive.bag"
    path.write_bytes(b"#ROSBAG V2.0\n" + (0xFFFFFFFF).to_bytes(4, "little") + b"op=\x03")
    tracemalloc.start()
    with pytest.raises(DatasetError, match="cannot be opened as a bag"):
        open_dataset(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50_000_000
