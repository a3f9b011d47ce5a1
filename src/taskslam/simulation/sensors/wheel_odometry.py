"""Wheel odometry as the Kobuki and its Gazebo plugin make it: encoders give distance, a gyro gives heading.

Protocol 4.6. Drift is the gyro's white noise and its bias (one draw per run), a systematic distance scale, and slip. On
a worn robot the bias is also drawn anew at each reset and walks, and so are scale and slip.
"""

from __future__ import annotations

import math

import numpy as np

from taskslam.geometry import SE2
from taskslam.measurements import Sensor, WheelOdometry
from taskslam.robot import Odometer
from taskslam.robot.imperfections import OdometerImperfections
from taskslam.simulation.drive import step_arc
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.walking_bias import WalkingBias
from taskslam.simulation.streams import stream


class WheelOdometer:
    """Integrates one gyro sample and one encoder increment per gyro period, from the true body motion."""

    sensor = Sensor.WHEEL_ODOMETRY

    def __init__(self, sheet: Odometer, wrong: OdometerImperfections, seed: int) -> None:
        self._sheet, self._wrong = sheet, wrong
        self._seed = seed
        self.rate = sheet.rate
        self._bias = wrong.gyro_bias * float(stream(seed, "odometry/gyro_bias").standard_normal())
        self.reset(0)

    def reset(self, count: int) -> None:
        """Zero the pose, as the Kobuki's reset command does; the run's bias stays, the noise gets fresh streams."""
        wrong = self._wrong
        self._gyro = stream(self._seed, "odometry/gyro_noise", count)
        self._wheels = stream(self._seed, "odometry/slip", count)
        self._turned_on = WalkingBias(self._seed, "odometry/gyro", count, 1, wrong.gyro_turn_on, wrong.gyro_walk)
        of_round = stream(self._seed, "odometry/wheels_of_round", count).standard_normal(2)
        self._scale = wrong.scale + (wrong.scale_of_round or 0.0) * float(of_round[0])
        self._slip = wrong.slip + (wrong.slip_of_round or 0.0) * abs(float(of_round[1]))
        self._gyro_noise = np.empty(0)
        self._slip_noise = np.empty(0)
        self._next = 0
        self._x = self._y = self._theta = 0.0
        self._linear = self._angular = 0.0

    def integrate(self, distance: float, turned: float, dt: float) -> None:
        """Take in the true distance (m) and rotation (rad) of the last dt seconds."""
        if self._next == len(self._gyro_noise):
            self._gyro_noise = self._gyro.standard_normal(1000)
            self._slip_noise = self._wheels.standard_normal(1000)
            self._next = 0
        bias = self._bias + float(self._turned_on.after(dt)[0])
        rate = turned / dt + bias + self._sheet.gyro_noise * float(self._gyro_noise[self._next])
        slip = self._slip * math.sqrt(abs(distance)) * float(self._slip_noise[self._next])
        self._next += 1
        self._linear = (distance * (1.0 + self._scale) + slip) / dt
        self._angular = rate
        self._x, self._y, self._theta = step_arc(self._x, self._y, self._theta, self._linear, rate, dt)

    def measure(self, stamp: int, motion: Motion) -> WheelOdometry:  # noqa: ARG002 it has integrated the motion already
        """The odometry message of this instant."""
        theta = math.atan2(math.sin(self._theta), math.cos(self._theta))
        return WheelOdometry(stamp, SE2(self._x, self._y, theta), self._linear, self._angular)
