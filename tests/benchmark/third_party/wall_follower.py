"""A method that hears a sensor from outside: wheel odometry, and how much nearer the wall ahead has come."""

from wall_ranger import WallDistance

from taskslam.geometry import SE2
from taskslam.measurements import Sensor, WheelOdometry
from taskslam.slam import Kind, MethodCard, PoseEstimate, SlamMethod, Status


class WallFollower(SlamMethod):
    card = MethodCard(
        "wall_follower", "0.1", "MIT", Kind.ODOMETRY, (WallDistance.sensor, Sensor.WHEEL_ODOMETRY), odometry_prior=True
    )

    def start(self, rig):
        self.range_max = rig.parts()["wall_distance"].range_max
        self.pose = self.first = None

    def feed(self, measurement):
        if isinstance(measurement, WheelOdometry):
            self.pose = measurement.T_odom_base
            return None
        if self.pose is None or measurement.distance > self.range_max:
            return None
        if self.first is None:
            self.first = measurement.distance
        pose = SE2(self.first - measurement.distance, self.pose.y, self.pose.theta)
        return PoseEstimate(measurement.stamp, pose.matrix(), Status.TRACKING)
