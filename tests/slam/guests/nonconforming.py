"""Methods that each break exactly one promise. All but the broken part is wheel odometry."""

import random
import time
from dataclasses import replace

import numpy as np

from taskslam.measurements import Sensor
from taskslam.slam import Kind, MethodCard
from taskslam.slam.methods.wheel_odometry import WheelOdometryMethod


def card(**changes):
    return MethodCard("guest", "1", "MIT", Kind.ODOMETRY, (Sensor.WHEEL_ODOMETRY,), **changes)


class WantsTheTruth(WheelOdometryMethod):
    card = MethodCard("cheat", "1", "MIT", Kind.SLAM, (Sensor.TRUE_POSE,))


class WrongUnits(WheelOdometryMethod):
    """Millimetres."""

    card = card()

    def feed(self, measurement):
        estimate = super().feed(measurement)
        estimate.T_start_base[:2, 3] *= 1000.0
        return estimate


class Parrot(WheelOdometryMethod):
    """A scan gives a pose, and so does, once more, the odometry after it."""

    card = MethodCard("parrot", "1", "MIT", Kind.SLAM, (Sensor.WHEEL_ODOMETRY, Sensor.LASER_SCAN))

    def feed(self, measurement):
        if measurement.sensor is Sensor.WHEEL_ODOMETRY:
            self.last = super().feed(measurement)
        return self.last


class Dice(WheelOdometryMethod):
    card = card()

    def start(self, rig):
        super().start(rig)
        self.random = random.Random(time.time_ns())

    def feed(self, measurement):
        estimate = super().feed(measurement)
        estimate.T_start_base[0, 3] += 1e-6 * self.random.random()
        return estimate


class Hoarder(WheelOdometryMethod):
    card = card()

    def start(self, rig):
        super().start(rig)
        self.hoard = []

    def feed(self, measurement):
        self.hoard.append(np.ones(60000))
        return super().feed(measurement)


class Nomad(WheelOdometryMethod):
    """Starts in the odometry's frame shifted by 10 cm."""

    card = card()

    def feed(self, measurement):
        estimate = super().feed(measurement)
        estimate.T_start_base[0, 3] += 0.1
        return estimate


class Mute(WheelOdometryMethod):
    card = card()

    def feed(self, measurement):
        return None


class Forgetful(WheelOdometryMethod):
    """After loading a map it believes to be somewhere else."""

    card = card(can_save_map=True)
    shift = 0.0

    def feed(self, measurement):
        estimate = super().feed(measurement)
        estimate.T_start_base[0, 3] += self.shift
        return estimate

    def save_map(self, path):
        path.write_text("map", encoding="ascii")

    def load_map(self, path):
        self.shift = 3.0


class RaisesLate(WheelOdometryMethod):
    card = card()

    def feed(self, measurement):
        if measurement.stamp > 90_000_000_000:
            raise ValueError("too late")
        return super().feed(measurement)


class Unhurried(WheelOdometryMethod):
    """Keeps every promise, and does not say how long a scan takes."""

    card = MethodCard("unhurried", "1", "MIT", Kind.SLAM, (Sensor.WHEEL_ODOMETRY, Sensor.LASER_SCAN))

    def feed(self, measurement):
        if measurement.sensor is Sensor.WHEEL_ODOMETRY:
            self.last = super().feed(measurement)
            return None
        np.sort(np.arange(30000.0)[::-1] % 977)
        return replace(self.last, stamp=measurement.stamp)
