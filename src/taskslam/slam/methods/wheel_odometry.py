"""Wheel odometry alone: what the robot does without SLAM."""

from __future__ import annotations

from taskslam.geometry import SE2
from taskslam.measurements import Measurement, Sensor, WheelOdometry
from taskslam.robot import SensorRig
from taskslam.slam.base import Kind, MethodCard, PoseEstimate, SlamMethod, Status
from taskslam.version import __version__


class WheelOdometryMethod(SlamMethod):
    """`T_start_base` is the odometry since the first message: inverse(first `T_odom_base`) @ `T_odom_base`."""

    card = MethodCard(
        name="wheel_odometry",
        version=__version__,
        licence="Apache-2.0",
        kind=Kind.ODOMETRY,
        sensors=(Sensor.WHEEL_ODOMETRY,),
        latency=0.0,
        summary="The robot's own odometry, uncorrected: the lower bound that any SLAM method should beat.",
    )

    def start(self, rig: SensorRig) -> None:  # noqa: ARG002
        """Forget the origin; the next message sets it."""
        self._T_start_odom: SE2 | None = None

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """Answer each odometry message with its pose since the start."""
        if not isinstance(measurement, WheelOdometry):
            return None
        if self._T_start_odom is None:
            self._T_start_odom = measurement.T_odom_base.inverse()
        T_start_base = self._T_start_odom @ measurement.T_odom_base
        return PoseEstimate(measurement.stamp, T_start_base.matrix(), Status.TRACKING)
