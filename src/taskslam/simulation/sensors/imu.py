"""The IMU: what a strapped-down gyro and accelerometer say of the true motion (protocol 4.5).

A sample is the mean over its period, as delta-angle and delta-velocity sensors give it: noise-free samples integrate
back to the true trajectory. Gravity is 9.8 m/s^2, as in Gazebo's worlds, and shows as +9.8 on z at rest.
"""

from __future__ import annotations

from typing import Self

import numpy as np

from taskslam.geometry import FloatArray, invert_se3
from taskslam.measurements import NANOSECONDS, ImuSamples, Sensor
from taskslam.robot import Imu
from taskslam.robot.imperfections import ImuImperfections
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.simulated_sensor import Surroundings
from taskslam.simulation.streams import stream

GRAVITY = 9.8  # m/s^2


class InertialSensor:
    """Samples one IMU; the biases are drawn once per run, the noise anew after each reset."""

    sensor = Sensor.IMU

    def __init__(self, imu: Imu, wrong: ImuImperfections, seed: int) -> None:
        self._imu = imu
        self._seed = seed
        self.rate = imu.rate
        self._period = round(NANOSECONDS / imu.rate)
        self._R_imu_base = invert_se3(imu.mount.matrix())[:3, :3]
        self._lever = imu.mount.matrix()[:2, 3]
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

    def measure(self, stamp: int, motion: Motion) -> ImuSamples:
        """The one sample of the period that ends at `stamp`."""
        stamps = np.array([stamp - self._period, stamp])
        poses, velocities = motion.pose_at(stamps), motion.velocity_at(stamps)
        dt = self._period / NANOSECONDS
        change = self._world_velocity(poses, velocities)
        acceleration = (change[1] - change[0]) / dt
        middle = 0.5 * (poses[0, 2] + poses[1, 2])
        c, s = np.cos(middle), np.sin(middle)
        force = np.array(
            [c * acceleration[0] + s * acceleration[1], c * acceleration[1] - s * acceleration[0], GRAVITY]
        )
        rate = np.array([0.0, 0.0, (poses[1, 2] - poses[0, 2]) / dt])
        noise = self._noise.standard_normal(6)
        gyro = self._R_imu_base @ rate + self._gyro_bias + self._imu.gyro_noise * noise[:3]
        accel = self._R_imu_base @ force + self._accel_bias + self._imu.accel_noise * noise[3:]
        return ImuSamples(stamp, np.array([stamp], np.int64), gyro[None, :], accel[None, :])

    def _world_velocity(self, poses: FloatArray, velocities: FloatArray) -> FloatArray:
        """(N, 2) velocity of the IMU's place in `map`: the base's, and the turn about it at the lever arm."""
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        forward = velocities[:, 0] - velocities[:, 1] * self._lever[1]
        left = velocities[:, 1] * self._lever[0]
        return np.stack([c * forward - s * left, s * forward + c * left], axis=1)
