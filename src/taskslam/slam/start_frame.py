"""What the adapters of foreign odometries share: from their frames to ours."""

from __future__ import annotations

from taskslam.geometry import FloatArray, invert_se3


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
