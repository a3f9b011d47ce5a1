"""What a method needs of a robot, or one sentence that says what it lacks."""

from __future__ import annotations

from taskslam.errors import InputError
from taskslam.robot import Imu, Lidar2D, Lidar3D, SensorRig, StereoCamera


def need_lidar_2d(name: str, rig: SensorRig) -> Lidar2D:
    """The rig's planar LiDAR. Raises InputError if it has none."""
    if rig.lidar_2d is None:
        raise _lacking(name, "a 2D LiDAR", "lidar_2d")
    return rig.lidar_2d


def need_lidar_3d(name: str, rig: SensorRig) -> Lidar3D:
    """The rig's spinning LiDAR. Raises InputError if it has none."""
    if rig.lidar_3d is None:
        raise _lacking(name, "a 3D LiDAR", "lidar_3d")
    return rig.lidar_3d


def need_stereo(name: str, rig: SensorRig) -> StereoCamera:
    """The rig's stereo camera. Raises InputError if it has none."""
    if rig.stereo is None:
        raise _lacking(name, "a stereo camera", "stereo")
    return rig.stereo


def need_imu(name: str, rig: SensorRig) -> Imu:
    """The rig's IMU. Raises InputError if it has none."""
    if rig.imu is None:
        raise _lacking(name, "an IMU", "imu")
    return rig.imu


def _lacking(name: str, what: str, part: str) -> InputError:
    return InputError(f"{name} needs {what}, and this robot's sensor rig has none (rig.{part})")
