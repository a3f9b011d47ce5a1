"""Guests that misbehave in the middle of a tour. Named by the tests as `methods:Class`."""

from __future__ import annotations

import os
import signal

import numpy as np

from taskslam.measurements import Measurement, Sensor
from taskslam.robot import SensorRig
from taskslam.slam import Kind, MethodCard, PoseEstimate, SlamMethod, Status

_AFTER = 8_000_000_000  # ns; well into the first or second goal


class Honest(SlamMethod):
    """Wheel odometry."""

    card = MethodCard("honest", "1", "Apache-2.0", Kind.ODOMETRY, (Sensor.WHEEL_ODOMETRY,))

    def start(self, rig: SensorRig) -> None:
        self.origin = None
        self.begun: int | None = None

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        self.begun = measurement.stamp if self.begun is None else self.begun
        self.origin = self.origin or measurement.T_odom_base
        pose = (self.origin.inverse() @ measurement.T_odom_base).matrix()
        if measurement.stamp - self.begun > _AFTER:
            return self.misbehave(measurement, pose)
        return PoseEstimate(measurement.stamp, pose, Status.TRACKING)

    def misbehave(self, measurement: Measurement, pose: np.ndarray) -> PoseEstimate | None:
        return PoseEstimate(measurement.stamp, pose, Status.TRACKING)


class Heavy(Honest):
    """Holds 256 MB for a moment as it starts."""

    def start(self, rig: SensorRig) -> None:
        super().start(rig)
        np.ones(32 << 20).sum()


class Segfault(Honest):
    """Dies by a signal."""

    def misbehave(self, measurement: Measurement, pose: np.ndarray) -> PoseEstimate | None:
        os.kill(os.getpid(), signal.SIGSEGV)
        return None


class NotANumber(Honest):
    """Returns a pose with NaN."""

    def misbehave(self, measurement: Measurement, pose: np.ndarray) -> PoseEstimate | None:
        return PoseEstimate(measurement.stamp, pose * np.nan, Status.TRACKING)


class BackInTime(Honest):
    """Stamps a pose before the one it gave last."""

    def misbehave(self, measurement: Measurement, pose: np.ndarray) -> PoseEstimate | None:
        return PoseEstimate(measurement.stamp - 1_000_000_000, pose, Status.TRACKING)


class Lost(Honest):
    """Says that it is lost, for ever."""

    def misbehave(self, measurement: Measurement, pose: np.ndarray) -> PoseEstimate | None:
        return PoseEstimate(measurement.stamp, pose, Status.LOST)


class Jumps(Honest):
    """Moves into another map, five metres away."""

    def misbehave(self, measurement: Measurement, pose: np.ndarray) -> PoseEstimate | None:
        pose = pose.copy()
        pose[0, 3] += 5.0
        return PoseEstimate(measurement.stamp, pose, Status.TRACKING)
