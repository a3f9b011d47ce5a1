"""Guests that make use of a sensor which a robot may lack."""

import numpy as np

from taskslam.measurements import ImuSamples, Sensor
from taskslam.slam.base import Kind, MethodCard, PoseEstimate, SlamMethod, Status


class CountsSamples(SlamMethod):
    """Says as x, at every scan, how many inertial measurements it was given since the start."""

    card = MethodCard(
        "counts", "1", "MIT", Kind.ODOMETRY, (Sensor.LASER_SCAN,), latency=0.0, optional_sensors=(Sensor.IMU,)
    )

    def start(self, rig):
        self.count = 0

    def feed(self, measurement):
        if isinstance(measurement, ImuSamples):
            self.count += 1
            return None
        T = np.eye(4)
        T[0, 3] = self.count
        return PoseEstimate(measurement.stamp, T, Status.TRACKING)


class Spies(CountsSamples):
    """Would like the truth if it may."""

    card = MethodCard("spies", "1", "MIT", Kind.SLAM, (Sensor.LASER_SCAN,), optional_sensors=(Sensor.TRUE_POSE,))
