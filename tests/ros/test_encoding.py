"""What a node is told, and how its poses become ours, whatever frame it speaks of."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores
from scipy.spatial.transform import Rotation

from taskslam.datasets.bag_access import ros_types
from taskslam.errors import InputError
from taskslam.geometry import SE2, invert_se3
from taskslam.measurements import NANOSECONDS, LaserScan, PointCloud, WheelOdometry
from taskslam.robot import load_robot
from taskslam.ros.encoding import EPOCH, NodeEncoder, Odometer, PoseReader, stamp_of, unknown_frames
from taskslam.ros.node_file import Answer, Extrinsic, Intrinsic
from taskslam.slam.base import InvalidOutputError

RIG = load_robot("turtlebot2").rig
STORE = ros_types(Stores.ROS1_NOETIC)
CAMERA = "left_camera_optical_frame"
POSE = {"topic": "/pose", "type": "geometry_msgs/PoseStamped"}
STAMP = 5 * NANOSECONDS

numbers = st.floats(-50, 50)
angles = st.floats(-3, 3)


@st.composite
def poses(draw):
    """(4, 4), anywhere and turned anyhow."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", [draw(angles) / 2, draw(angles) / 2, draw(angles)]).as_matrix()
    T[:3, 3] = draw(numbers), draw(numbers), draw(numbers)
    return T


def encoder(**frames):
    return NodeEncoder(STORE, RIG, frames)


def message(T, frame="map", stamp=STAMP):
    """geometry_msgs/PoseStamped as a node would say it."""
    new = {kind.rpartition("/")[2]: made for kind, made in STORE.types.items()}
    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat()
    at = dict(zip("xyz", T[:3, 3].tolist(), strict=True))
    pose = new["Pose"](position=new["Point"](**at), orientation=new["Quaternion"](x=x, y=y, z=z, w=w))
    return new["PoseStamped"](header=encoder().header(stamp, frame), pose=pose)


def reader(answer, odometer=None, **frames):
    return PoseReader(Answer(**answer), encoder(**frames), odometer or Odometer())


@given(poses(), poses())
def test_a_pose_of_any_frame_in_any_world_becomes_the_bases_since_the_start(T_start_base, T_world_start):
    T_base_of = encoder().in_base(CAMERA)
    worlds = {"base": np.eye(4), "of": invert_se3(T_base_of), "first": T_world_start}
    for origin, T_world_start_base in worlds.items():
        read = reader({**POSE, "of": CAMERA, "origin": origin}).read
        first = read(message(T_world_start_base @ T_base_of))
        later = read(message(T_world_start_base @ T_start_base @ T_base_of))
        np.testing.assert_allclose(first.pose, np.eye(4), atol=1e-9)
        np.testing.assert_allclose(later.pose, T_start_base, atol=1e-9)
        assert later.stamp == STAMP


def test_a_transform_to_odom_is_carried_on_to_the_base():
    odometer = Odometer()
    odometer.newest = WheelOdometry(STAMP, SE2(1.0, 2.0, 0.5), 0.0, 0.0)
    T_odom_base = odometer.at(STAMP)
    answer = {"transform": ("map", "odom"), "of": "odom", "ahead": 0.5}
    new = {kind.rpartition("/")[2]: made for kind, made in STORE.types.items()}
    told = encoder(base_footprint="odom", odom="map").base_in_odom(STAMP + NANOSECONDS // 2, SE2(0.1, 0.2, 0.3))
    other = encoder(base_footprint="else", odom="map").base_in_odom(STAMP, SE2(9.0, 9.0, 0.0))
    both = new["TFMessage"](transforms=[*other.transforms, *told.transforms])
    heard = reader(answer, odometer).read(both)
    assert heard.stamp == STAMP
    np.testing.assert_allclose(heard.pose, (SE2(0.1, 0.2, 0.3) @ T_odom_base).matrix(), atol=1e-12)
    assert reader(answer, odometer).read(other) is None


def test_what_is_no_pose_is_said():
    broken = message(np.eye(4))
    broken.pose.position.x = float("nan")
    with pytest.raises(InvalidOutputError, match="not finite"):
        reader(POSE).read(broken)
    with pytest.raises(InvalidOutputError, match="a pose in the frame 'world'; expected 'map'"):
        reader({**POSE, "world": "map"}).read(message(np.eye(4), "world"))


@given(st.floats(-1, 1), st.floats(-2, 2), st.floats(0.0, 0.1))
def test_between_odometry_the_base_goes_on_by_its_last_velocities(linear, angular, seconds):
    odometer = Odometer()
    odometer.newest = WheelOdometry(STAMP, SE2(1.0, 2.0, 0.5), linear, angular)
    later = STAMP + round(seconds * NANOSECONDS)
    steps = 300
    x, y, theta = 1.0, 2.0, 0.5
    for _ in range(steps):  # Euler's midpoint steps
        middle = theta + 0.5 * angular * seconds / steps
        x += linear * seconds / steps * np.cos(middle)
        y += linear * seconds / steps * np.sin(middle)
        theta += angular * seconds / steps
    at = odometer.at(later)
    np.testing.assert_allclose(at.array(), [x, y, theta], atol=1e-6)
    assert odometer.told(later + 5) == at
    assert odometer.at(STAMP) == SE2(1.0, 2.0, 0.5)
    assert odometer.at(STAMP - 1) is None


def test_stamps_begin_where_ros_knows_time_and_frames_bear_the_nodes_names():
    ranges = np.full(3, 2.0, np.float32)
    said = encoder(laser="base_scan").utterance(LaserScan(0, ranges, 0.0, 0.1, 0.1, 10.0, 1_000_000))
    ((topic, scan),) = said.messages
    assert (topic, scan.header.frame_id) == ("/scan", "base_scan")
    assert scan.header.stamp.sec * NANOSECONDS + scan.header.stamp.nanosec == EPOCH - 2_000_000
    assert (said.stamp, said.bears, stamp_of(scan)) == (0, -2_000_000, -2_000_000)
    ((_, odometry),) = encoder(base_footprint="base_link").utterance(WheelOdometry(7, SE2(), 0.0, 0.0)).messages
    assert odometry.child_frame_id == "base_link"


@pytest.mark.parametrize(
    ("clouds_from", "stamp", "rings", "times"),
    [("first", -90, [0, 1, 0, 1], [0.0, 0.03, 0.09, 0.09]), ("last", 0, [0, 0, 1, 1], [-0.09, 0.0, -0.06, 0.0])],
)
def test_a_cloud_begins_with_its_first_firing_or_is_told_ring_by_ring(clouds_from, stamp, rings, times):
    ms = 1_000_000
    ages = np.array([-90, 0, -60, 0], np.int32) * ms
    cloud = PointCloud(STAMP, np.ones((4, 3), np.float32), np.array([0, 0, 1, 1], np.uint16), ages)
    said = NodeEncoder(STORE, RIG, {}, clouds_from).utterance(cloud)
    ((_, message),) = said.messages
    assert (said.stamp, said.bears) == (STAMP, STAMP + stamp * ms)
    told = np.frombuffer(message.data.tobytes(), np.dtype([("xyz", "<f4", 3), ("ring", "<u2"), ("time", "<f4")]))
    assert told["ring"].tolist() == rings
    np.testing.assert_allclose(told["time"], times, atol=1e-7)


def test_an_intrinsic_says_what_the_published_camera_is():
    fx, fy, cx, cy = encoder().intrinsic(Intrinsic(what="pinhole"))
    assert (fx, fy) == pytest.approx((360.06528871, 360.06528871), abs=1e-6)  # as the authors' settings have it
    assert (cx, cy) == (376.0, 240.0)
    assert encoder().intrinsic(Intrinsic(what="resolution")) == [752, 480]
    with pytest.raises(InputError, match=r"the robot has no .*whose pinhole the node is to be told"):
        encoder().intrinsic(Intrinsic(of="rgbd_images", what="pinhole"))


def test_an_extrinsic_says_where_one_frame_lies_in_another():
    there = {"of": "velodyne", "seen_from": "imu_link"}
    lidar, imu = RIG.lidar_3d.mount.matrix(), RIG.imu.mount.matrix()
    T = invert_se3(imu) @ lidar
    told = {what: encoder().extrinsic(Extrinsic(**there, what=what)) for what in ("xyz", "rotation", "matrix", "rows")}
    np.testing.assert_allclose(told["xyz"], T[:3, 3])
    np.testing.assert_allclose(np.reshape(told["rotation"], (3, 3)), T[:3, :3])
    np.testing.assert_allclose(np.reshape(told["matrix"], (4, 4)), T)
    assert told["rows"] == T.tolist()
    with pytest.raises(InputError, match=r"the frame 'velodine' is none of this robot's.* Did you mean 'velodyne'"):
        encoder().extrinsic(Extrinsic(of="velodine", seen_from="imu_link", what="xyz"))


def test_a_parameter_that_names_a_frame_that_nobody_tells_is_noticed():
    known = {"odom", "base_link"}
    assert list(unknown_frames({"odom_frame": "odom", "base_frame": "/base_link", "rate": 3, "frame": 1}, known)) == []
    (words,) = unknown_frames({"odom_frame": "odm"}, known)
    assert words.endswith("Did you mean 'odom'?")
