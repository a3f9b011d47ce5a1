"""Integrates the body velocities of the wheel odometry: a whole method in twenty lines."""

from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, Sensor
from taskslam.slam import Kind, MethodCard, PoseEstimate, SlamMethod, Status


class DeadReckoning(SlamMethod):
    card = MethodCard("dead_reckoning", "0.1", "MIT", Kind.ODOMETRY, (Sensor.WHEEL_ODOMETRY,))

    def __init__(self, scale: float = 1.0):
        self.scale = scale

    def start(self, rig):
        self.pose, self.stamp = SE2(), None

    def feed(self, odometry):
        dt = (odometry.stamp - (odometry.stamp if self.stamp is None else self.stamp)) / NANOSECONDS
        self.pose = self.pose @ SE2(self.scale * odometry.linear * dt, 0.0, odometry.angular * dt)
        self.stamp = odometry.stamp
        return PoseEstimate(odometry.stamp, self.pose.matrix(), Status.TRACKING)
