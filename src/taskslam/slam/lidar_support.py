"""What the adapters of foreign LiDAR odometries share: from their frames to ours, and what they need of a robot."""

from __future__ import annotations

from taskslam.errors import InputError
from taskslam.geometry import FloatArray, invert_se3
from taskslam.robot import Imu, Lidar3D, SensorRig


class StartFrame:
    """Turns poses of a sensor in a method's own world into `T_start_base`.

    T_base_sensor: (4, 4) the sensor's mount. The world is wherever the method puts it; the pose of the base at the
    first call is the start.
    """

    def __init__(self, T_base_sensor: FloatArray) -> None:
        self._T_sensor_base = invert_se3(T_base_sensor)
        self._T_start_world: FloatArray | None = None

    def pose(self, T_world_sensor: FloatArray) -> FloatArray:
        """(4, 4) `T_start_base` for a pose of the sensor."""
        T_world_base = T_world_sensor @ self._T_sensor_base
        if self._T_start_world is None:
            self._T_start_world = invert_se3(T_world_base)
        T_start_base: FloatArray = self._T_start_world @ T_world_base
        return T_start_base


def need_lidar_3d(name: str, rig: SensorRig) -> Lidar3D:
    """The rig's spinning LiDAR. Raises InputError if it has none."""
    if rig.lidar_3d is None:
        raise InputError(f"{name} needs a 3D LiDAR, and this robot's sensor rig has none (rig.lidar_3d)")
    return rig.lidar_3d


def need_imu(name: str, rig: SensorRig) -> Imu:
    """The rig's IMU. Raises InputError if it has none."""
    if rig.imu is None:
        raise InputError(f"{name} needs an IMU, and this robot's sensor rig has none (rig.imu)")
    return rig.imu
