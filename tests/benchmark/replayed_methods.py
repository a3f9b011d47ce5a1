"""Guests for replays. Named by the tests as `replayed_methods:Class`."""

from __future__ import annotations

import os

import numpy as np

from taskslam.measurements import LaserScan, Measurement, Sensor, TruePose
from taskslam.robot import SensorRig
from taskslam.slam import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod, Status

_SENSORS = (Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY)


class Counting(SlamMethod):
    """Goes one metre forward with every scan, and refuses to go back in time."""

    card = MethodCard("counting", "1", "Apache-2.0", Kind.SLAM, _SENSORS, map_mode=MapMode.CONTINUE)

    def start(self, rig: SensorRig) -> None:
        self.T_start_base = np.eye(4)
        self.newest = -1

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        if measurement.stamp < self.newest:
            raise ValueError("back in time")
        self.newest = measurement.stamp
        if not isinstance(measurement, LaserScan):
            return None
        self.T_start_base = self.T_start_base.copy()
        self.T_start_base[0, 3] += 1.0
        return PoseEstimate(measurement.stamp, self.T_start_base, Status.TRACKING)


class Slow(Counting):
    """Takes a quarter of a second for a scan."""

    card = MethodCard("slow", "1", "Apache-2.0", Kind.SLAM, _SENSORS, latency=0.25)


class Nosy(Counting):
    """Breaks down if it is told the truth."""

    card = MethodCard("nosy", "1", "Apache-2.0", Kind.SLAM, _SENSORS)

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        if isinstance(measurement, TruePose):
            raise TypeError("was told the truth")
        return super().feed(measurement)


class Dies(Counting):
    """Ends its process at the twentieth scan."""

    card = MethodCard("dies", "1", "Apache-2.0", Kind.SLAM, _SENSORS)

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        if self.T_start_base[0, 3] >= 20:
            os._exit(3)
        return super().feed(measurement)
