"""What the conformance drive feeds: the same however it is cut, and true to the room and the motion."""

import numpy as np
import pytest

from taskslam.geometry import wrap
from taskslam.measurements import NANOSECONDS, ImuSamples, LaserScan, PointCloud, Sensor
from taskslam.robot import Imperfections
from taskslam.slam.conformance import room as conformance_room
from taskslam.slam.conformance.drive import BY_FORMULA, ConformanceDrive

SECOND = NANOSECONDS
INERTIAL = {Sensor.POINT_CLOUD, Sensor.IMU}


def changed(rig, part, **fields):
    return rig.model_copy(update={part: getattr(rig, part).model_copy(update=fields)})


def of(kind, measurements):
    return [m for m in measurements if isinstance(m, kind)]


def equal(one, two):
    fields = type(one).__dataclass_fields__
    return type(one) is type(two) and all(np.array_equal(getattr(one, f), getattr(two, f)) for f in fields)


def test_the_drive_is_the_same_however_it_is_cut(rig):
    drive = ConformanceDrive(rig, sensors=BY_FORMULA)
    whole = list(drive.measurements(0, 3 * SECOND))
    parts = [*drive.measurements(0, SECOND), *drive.measurements(SECOND, 3 * SECOND)]
    assert len(whole) == 3 * (2 * 50 + 100 + 10 + 10)
    assert all(equal(one, two) for one, two in zip(whole, parts, strict=True))
    at_two = [m.sensor for m in whole if m.stamp == 2 * SECOND]
    assert at_two == ["true_pose", "wheel_odometry", "imu", "laser_scan", "point_cloud"]


def test_it_begins_at_rest_at_the_origin_and_closes_its_lap(rig):
    drive = ConformanceDrive(rig, still=2.0)
    assert drive.pose(0) == drive.pose(2 * SECOND)
    assert drive.pose(0).distance_to(type(drive.pose(0))()) < 1e-12
    after_a_lap = drive.pose(round((2.0 + 0.5 + drive.lap) * SECOND))
    assert after_a_lap.distance_to(drive.pose(0)) < 1e-3


def test_ranges_are_those_of_the_room(rig):
    """From the start the island lies 1.3 m to the left, the outer wall 1.2 m to the right."""
    mount = rig.lidar_2d.mount.model_copy(update={"xyz": (0.0, 0.0, 0.4)})
    drive = ConformanceDrive(changed(rig, "lidar_2d", noise=0.0, mount=mount))
    scan = of(LaserScan, drive.measurements(0, SECOND))[0]
    angles = scan.angles()
    left, right = np.argmin(abs(angles - np.pi / 2)), np.argmin(abs(angles + np.pi / 2))
    assert scan.ranges[left] == pytest.approx(1.3, abs=1e-3)
    assert scan.ranges[right] == pytest.approx(1.2, abs=1e-3)


@pytest.mark.parametrize("rolling", [False, True])
def test_the_points_of_a_cloud_lie_on_the_floor_and_on_the_boxes(rig, rolling):
    noiseless = changed(rig, "lidar_3d", noise=0.0, rolling=rolling)
    drive = ConformanceDrive(noiseless, still=0.0, sensors=INERTIAL)
    cloud = of(PointCloud, drive.measurements(4 * SECOND, 4 * SECOND + 1))[0]
    assert cloud.time_offset.min() == (round(-SECOND / 10 * 439 / 440) if rolling else 0)
    x, y, z = cloud.points.astype(float).T + np.array(rig.lidar_3d.mount.xyz)[:, None]
    poses = np.array([drive.pose(cloud.stamp + int(t)).array() for t in cloud.time_offset])
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    in_room = np.stack([poses[:, 0] + c * x - s * y, poses[:, 1] + s * x + c * y - 1.8, z], axis=1)  # start: (0, -1.8)
    standing = [(x0, y0, x1, y1, 0.0, top) for x0, y0, x1, y1, top in conformance_room.STANDING]
    off = np.array([to_surface(box, in_room) for box in [*standing, *conformance_room.HANGING]])
    assert off.min(axis=0).max() < 2e-5
    assert (off[0] < 1e-4).sum() > 1500
    assert (off[1:].min(axis=0) < 1e-4).sum() > 500


def to_surface(box, points):
    """Distance of (N, 3) points to the surface of a box, from within or without."""
    x0, y0, x1, y1, bottom, top = box
    low, high = np.array([x0, y0, bottom]), np.array([x1, y1, top])
    beyond = np.maximum(low - points, points - high)
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return np.where(outside > 0, outside, np.abs(beyond.max(axis=1)))


def test_inertial_samples_without_noise_integrate_to_the_motion(rig):
    quiet = changed(rig, "imu", gyro_noise=0.0, accel_noise=0.0)
    quiet = changed(quiet, "imu", mount=quiet.imu.mount.model_copy(update={"rpy": (0.1, -0.2, 0.7)}))
    drive = ConformanceDrive(quiet, still=1.0, sensors=INERTIAL, imperfections=Imperfections())
    lever, R = np.array(quiet.imu.mount.xyz), quiet.imu.mount.matrix()[:3, :3]
    theta, velocity, place = 0.0, np.zeros(3), lever.copy()
    for sample in of(ImuSamples, drive.measurements(1, 20 * SECOND)):
        turn = (R @ sample.angular_velocity[0])[2] / 100
        force = R @ sample.linear_acceleration[0] - np.array([0.0, 0.0, 9.8])
        c, s = np.cos(theta + turn / 2), np.sin(theta + turn / 2)
        gain = np.array([c * force[0] - s * force[1], s * force[0] + c * force[1], force[2]]) / 100
        place += (velocity + gain / 2) / 100
        velocity, theta = velocity + gain, theta + turn
    truth = drive.pose(sample.stamp)
    c, s = np.cos(truth.theta), np.sin(truth.theta)
    expected = [truth.x + c * lever[0] - s * lever[1], truth.y + s * lever[0] + c * lever[1], lever[2]]
    assert abs(wrap([theta - truth.theta])[0]) < 1e-6
    np.testing.assert_allclose(place, expected, atol=0.01)


def test_what_is_not_listened_to_is_not_made(rig):
    kinds = {m.sensor for m in ConformanceDrive(rig, sensors={Sensor.IMU}).measurements(0, SECOND)}
    assert kinds == {"true_pose", "wheel_odometry", "imu"}
