"""Bags as they are in the field (data/bags), and ones written and damaged here."""

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from taskslam.datasets.bag_trajectories import POSES, read_bag_trajectory
from taskslam.errors import TrajectoryError


def message(store, kind, stamp, x):
    types = store.types
    header_type = types["std_msgs/msg/Header"]
    extra = {"seq": 0} if "seq" in header_type.__dataclass_fields__ else {}
    time = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    header = header_type(stamp=time, frame_id="map", **extra)
    turn = types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.6, w=0.8)
    if kind.endswith("TransformStamped"):
        shift = types["geometry_msgs/msg/Vector3"](x=x, y=2.0, z=3.0)
        return types[kind](header, "base", types["geometry_msgs/msg/Transform"](shift, turn))
    pose = types["geometry_msgs/msg/Pose"](types["geometry_msgs/msg/Point"](x=x, y=2.0, z=3.0), turn)
    with_covariance = types["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36))
    if kind.endswith("Odometry"):
        still = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
        twist = types["geometry_msgs/msg/Twist"](still, still)
        return types[kind](
            header, "base", with_covariance, types["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36))
        )
    return types[kind](header, with_covariance if "Covariance" in kind else pose)


def write_bag(path, topics):
    """A recording of five poses a topic, {topic: type}; by the name a ROS 1 bag, an MCAP or a sqlite folder."""
    ros1 = path.suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_JAZZY)
    if ros1:
        writer = Ros1Writer(path)
    else:
        plugin = StoragePlugin.MCAP if path.suffix == ".mcap" else StoragePlugin.SQLITE3
        writer = Ros2Writer(path.with_suffix(""), version=9, storage_plugin=plugin)
    with writer:
        for topic, kind in topics.items():
            link = writer.add_connection(topic, kind, typestore=store)
            for index in range(5):
                stamp = 1403636580_000000001 + index * 50_000_000
                if kind.startswith("std_msgs"):
                    content = store.types[kind](f"hello {index}")
                else:
                    content = message(store, kind, stamp, float(index))
                encode = store.serialize_ros1 if ros1 else store.serialize_cdr
                writer.write(link, stamp + 5, encode(content, kind))
    return path if ros1 else path.with_suffix("")


@pytest.fixture(params=["drive.bag", "drive.mcap", "drive.db3"])
def place(request, tmp_path):
    return tmp_path / request.param


@pytest.mark.parametrize("kind", POSES)
def test_every_type_is_read_with_the_stamps_of_its_headers(place, kind):
    trajectory = read_bag_trajectory(write_bag(place, {"/pose": kind})).trajectory
    assert trajectory.stamps.tolist() == [1403636580_000000001 + index * 50_000_000 for index in range(5)]
    assert trajectory.positions[:, 0].tolist() == [0, 1, 2, 3, 4]
    np.testing.assert_allclose(trajectory.quaternions, np.tile([0, 0, 0.6, 0.8], (5, 1)))


def test_one_of_several_topics_must_be_named(place):
    path = write_bag(place, {"/odom": "nav_msgs/msg/Odometry", "/gt": "geometry_msgs/msg/PoseStamped"})
    with pytest.raises(TrajectoryError, match="name the topic, FILE:TOPIC; topics with poses: /gt, /odom"):
        read_bag_trajectory(path)
    assert len(read_bag_trajectory(path, "/gt").trajectory) == 5
    with pytest.raises(TrajectoryError, match="no topic /nope; topics with poses: /gt, /odom"):
        read_bag_trajectory(path, "/nope")


def test_another_type_beside_does_not_matter_but_is_not_read(place):
    path = write_bag(place, {"/odom": "nav_msgs/msg/Odometry", "/talk": "std_msgs/msg/String"})
    assert len(read_bag_trajectory(path).trajectory) == 5
    with pytest.raises(
        TrajectoryError, match="/talk is of type std_msgs/msg/String, which is not read; expected one of"
    ):
        read_bag_trajectory(path, "/talk")


def test_an_unknown_message_type_beside_the_poses_does_not_matter(tmp_path):
    path = tmp_path / "drive.bag"
    store = get_typestore(Stores.ROS1_NOETIC)
    with Ros1Writer(path) as writer:
        poses = writer.add_connection("/gt", "geometry_msgs/msg/PoseStamped", typestore=store)
        odd = writer.add_connection("/odd", "acme_msgs/msg/Teleport", msgdef="warp nine\n???", md5sum="0" * 32)
        for index in range(3):
            content = message(store, "geometry_msgs/msg/PoseStamped", index * 10**9, 1.0)
            writer.write(poses, index, store.serialize_ros1(content, "geometry_msgs/msg/PoseStamped"))
            writer.write(odd, index, b"\x00\x01")
    assert len(read_bag_trajectory(path).trajectory) == 3
    with pytest.raises(TrajectoryError, match="/odd is of type acme_msgs/msg/Teleport, which is not read"):
        read_bag_trajectory(path, "/odd")


@pytest.mark.parametrize("share", [0.0, 0.001, 0.3, 0.7, 0.99])
@pytest.mark.parametrize("name", ["drive.bag", "drive.mcap", "drive.db3"])
def test_a_truncated_recording_is_an_error_that_names_it(tmp_path, name, share):
    path = write_bag(tmp_path / name, {"/odom": "nav_msgs/msg/Odometry"})
    file = path if path.is_file() else next(path.glob("drive*" + (tmp_path / name).suffix))
    data = file.read_bytes()
    file.write_bytes(data[: int(share * len(data))])
    with pytest.raises(TrajectoryError, match=r"drive\S*: (damaged|.*topics with poses)"):
        read_bag_trajectory(path)


def test_the_recordings_of_the_field(data):
    bags = data / "bags"
    assert len(read_bag_trajectory(bags / "ROS_example.bag", "S-PTAM").trajectory) == 5439
    odometry = read_bag_trajectory(bags / "nav2_turtlebot.mcap", "/odom").trajectory
    assert len(odometry) == 2639
    assert len(read_bag_trajectory(bags / "nav2_turtlebot.mcap", "/amcl_pose").trajectory) == 135
    with pytest.raises(TrajectoryError, match=r"topics with poses: none \(it has /tf, /tf_static\)"):
        read_bag_trajectory(bags / "tf_example")
