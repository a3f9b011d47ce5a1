"""The IMU: what a strapped-down gyro and accelerometer say of the true motion (protocol 4.5).

A sample is the mean over its period, as delta-angle and delta-velocity sensors give it: noise-free samples integrate
back to the true trajectory. Gravity is 9.8 m/s^2, as in Gazebo's worlds, and shows as +9.8 on z at rest.
"""

from __future__ import annotations

import math
from typing import Self

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import invert_se3
from taskslam.measurements import NANOSECONDS, ImuSamples, Sensor
from taskslam.robot import Imu
from taskslam.robot.imperfections import ImuImperfections
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.simulated_sensor import Surroundings
from taskslam.simulation.sensors.walking_bias import WalkingBias
from taskslam.simulation.streams import stream

GRAVITY = 9.8  # m/s^2


class InertialSensor:
    """Samples one IMU; the biases are drawn once per run, the noise anew after each reset, a worn gyro's bias too."""

    sensor = Sensor.IMU

    def __init__(self, imu: Imu, wrong: ImuImperfections, seed: int) -> None:
        self._imu, self._wrong = imu, wrong
        self._seed = seed
        self.rate = imu.rate
        self._period = round(NANOSECONDS / imu.rate)
        self._R_imu_base = np.ascontiguousarray(invert_se3(imu.mount.matrix())[:3, :3])
        self._lever = np.ascontiguousarray(imu.mount.matrix()[:2, 3])
        self._gyro_bias = wrong.gyro_bias * stream(seed, "imu/gyro_bias").standard_normal(3)
        self._accel_bias = wrong.accel_bias * stream(seed, "imu/accel_bias").standard_normal(3)
        self.reset(0)

    @classmethod
    def fitted(cls, imu: Imu, surroundings: Surroundings) -> Self:
        """As a robot carries it through a world."""
        return cls(imu, surroundings.imperfections.imu, surroundings.seed)

    def reset(self, count: int) -> None:
        """Fresh noise stream after the count-th reset."""
        self._noise = stream(self._seed, "imu/noise", count)
        self._turned_on = WalkingBias(self._seed, "imu/gyro", count, 3, self._wrong.gyro_turn_on, self._wrong.gyro_walk)

    def measure(self, stamp: int, motion: Motion) -> ImuSamples:
        """The one sample of the period that ends at `stamp`."""
        states = motion.states_at([stamp - self._period, stamp])
        gyro, accel = _sample(states, self._period / NANOSECONDS, self._lever, self._R_imu_base)
        noise = self._noise.standard_normal(6)
        turned_on = self._turned_on.after(self._period / NANOSECONDS)
        gyro += self._gyro_bias + turned_on + self._imu.gyro_noise * noise[:3]
        accel += self._accel_bias + self._imu.accel_noise * noise[3:]
        return ImuSamples(stamp, np.array([stamp], np.int64), gyro[None, :], accel[None, :])


@njit(cache=True)
def _sample(states, dt, lever, rotation):  # type: ignore[no-untyped-def]
    """Mean angular velocity and specific force in the IMU's frame between two states x, y, theta, v, omega of the base.

    The IMU's place has the velocity of the base and that of the turn about it at the lever arm.
    """
    before, after = _place_velocity(states[0], lever), _place_velocity(states[1], lever)
    ahead, aside = (after[0] - before[0]) / dt, (after[1] - before[1]) / dt
    middle = 0.5 * (states[0, 2] + states[1, 2])
    c, s = math.cos(middle), math.sin(middle)
    force = (c * ahead + s * aside, c * aside - s * ahead, GRAVITY)
    turn = (states[1, 2] - states[0, 2]) / dt
    gyro, accel = np.empty(3), np.empty(3)
    for k in range(3):
        gyro[k] = rotation[k, 2] * turn
        accel[k] = rotation[k, 0] * force[0] + rotation[k, 1] * force[1] + rotation[k, 2] * force[2]
    return gyro, accel


@njit(cache=True)
def _place_velocity(state, lever):  # type: ignore[no-untyped-def]
    """Velocity of the IMU's place in `map`."""
    c, s = math.cos(state[2]), math.sin(state[2])
    forward, left = state[3] - state[4] * lever[1], state[4] * lever[0]
    return c * forward - s * left, s * forward + c * left
