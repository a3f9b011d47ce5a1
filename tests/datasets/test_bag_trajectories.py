"""Bags as they are in the field (data/bags), and ones written and damaged here."""

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from taskslam.datasets.bag_access import ros_types
from taskslam.datasets.bag_trajectories import PATH, POSES, TREE, is_bag, read_bag_trajectory
from taskslam.datasets.trajectory_files import split_topic
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
    with pytest.raises(
        TrajectoryError, match=r"drive\S*: (exists, but is no bag|cannot be|damaged|.*topics with poses)"
    ):
        read_bag_trajectory(path)


def pose_array(store, kind, stamp, count):
    """A nav_msgs/Path or TFMessage of `count` poses, of which a TFMessage moves two frames."""
    inner = "geometry_msgs/msg/PoseStamped" if kind == PATH else "geometry_msgs/msg/TransformStamped"
    poses = [message(store, inner, stamp + index * 50_000_000, float(index)) for index in range(count)]
    if kind == PATH:
        return store.types[kind](poses[0].header, poses)
    other = message(store, inner, stamp, 99.0)
    object.__setattr__(other, "child_frame_id", "/wheel")
    return store.types[kind]([*poses, other])


@pytest.mark.parametrize(("kind", "topic"), [(PATH, "/path"), (TREE, "/tf:base")])
def test_paths_and_trees_of_transforms_are_trajectories(tmp_path, kind, topic):
    path = tmp_path / "drive.bag"
    store = ros_types(Stores.ROS1_NOETIC)
    with Ros1Writer(path) as writer:
        link = writer.add_connection(topic.partition(":")[0], kind, typestore=store)
        for index, count in enumerate((1, 4, 3) if kind == PATH else (1, 1, 1)):
            stamp = 1403636580 * 10**9 + (0 if kind == PATH else index * 10**8)
            writer.write(link, index, store.serialize_ros1(pose_array(store, kind, stamp, count), kind))
    trajectory = read_bag_trajectory(path, topic).trajectory
    assert trajectory.positions[:, 0].tolist() == ([0, 1, 2, 3] if kind == PATH else [0, 0, 0])
    if kind == TREE:
        with pytest.raises(TrajectoryError, match="/tf holds the frames base, wheel; name one, FILE:/tf:FRAME"):
            read_bag_trajectory(path, "/tf")
        assert split_topic(f"{path}:/tf:base") == (path, "/tf:base")


def test_a_recording_is_what_it_holds_not_what_it_is_called(tmp_path):
    folder = write_bag(tmp_path / "drive.mcap", {"/odom": "nav_msgs/msg/Odometry"})
    called_bag = folder.rename(tmp_path / "other.bag")
    assert len(read_bag_trajectory(called_bag).trajectory) == 5
    (called_bag / "metadata.yaml").unlink()
    assert len(read_bag_trajectory(called_bag).trajectory) == 5
    sqlite = write_bag(tmp_path / "plain.db3", {"/odom": "nav_msgs/msg/Odometry"})
    (sqlite / "metadata.yaml").unlink()
    assert is_bag(sqlite)
    assert len(read_bag_trajectory(sqlite).trajectory) == 5
    (file,) = sqlite.iterdir()
    assert len(read_bag_trajectory(file).trajectory) == 5


@pytest.mark.parametrize(
    ("name", "command"), [("drive.bag", "rosbag reindex drive.bag"), ("drive.mcap", "mcap recover")]
)
def test_a_recording_that_was_cut_off_names_the_command_that_mends_it(tmp_path, name, command):
    path = write_bag(tmp_path / name, {"/odom": "nav_msgs/msg/Odometry"})
    file = path if path.is_file() else next(path.glob("drive*.mcap"))
    cut = tmp_path / "cut" / name
    cut.parent.mkdir()
    data = bytearray(file.read_bytes())
    if name.endswith(".bag"):  # as a recorder that was killed leaves it: no index yet
        at = data.index(b"index_pos=") + len(b"index_pos=")
        data[at : at + 8] = bytes(8)
    cut.write_bytes(data if name.endswith(".bag") else data[:-100])
    with pytest.raises(TrajectoryError, match=rf"{name}: cannot be opened as a bag: .*; {command}"):
        read_bag_trajectory(cut)


def test_one_message_that_is_no_pose_costs_that_message(tmp_path):
    path = tmp_path / "drive.bag"
    store = get_typestore(Stores.ROS1_NOETIC)
    kind = "geometry_msgs/msg/PoseStamped"
    with Ros1Writer(path) as writer:
        link = writer.add_connection("/gt", kind, typestore=store)
        for index in range(9):
            content = store.serialize_ros1(message(store, kind, index * 10**9, 1.0), kind)
            writer.write(link, index, content if index != 4 else content[:20])
    read = read_bag_trajectory(path)
    assert len(read.trajectory) == 8
    (note,) = read.notes
    assert note.startswith("left out: 1 messages that cannot be decoded (first: ")


def test_the_recordings_of_the_field(data):
    bags = data / "bags"
    assert len(read_bag_trajectory(bags / "ROS_example.bag", "S-PTAM").trajectory) == 5439
    odometry = read_bag_trajectory(bags / "nav2_turtlebot.mcap", "/odom").trajectory
    assert len(odometry) == 2639
    assert len(read_bag_trajectory(bags / "nav2_turtlebot.mcap", "/amcl_pose").trajectory) == 135
    with pytest.raises(TrajectoryError, match=r"topics with poses: none \(it has /tf, /tf_static\)"):
        read_bag_trajectory(bags / "tf_example")
