"""The planar LiDAR: rays by Embree, range limits and noise as Gazebo's ray sensors have them (protocol 4.2)."""

from __future__ import annotations

from typing import Self

import numpy as np

from taskslam.compiled import njit
from taskslam.measurements import NANOSECONDS, LaserScan, Sensor
from taskslam.robot import Lidar2D
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.counted_noise import QUANTILES, drawn, next_key
from taskslam.simulation.sensors.faint_rays import FaintRays
from taskslam.simulation.sensors.ray_fan import RayFan
from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.simulation.sensors.simulated_sensor import Surroundings
from taskslam.simulation.streams import stream


class LaserScanner:
    """Turns the true motion into scans. The mount may be pitched or rolled; the base stays level."""

    sensor = Sensor.LASER_SCAN

    def __init__(self, lidar: Lidar2D, rays: RayCaster | FaintRays, seed: int) -> None:
        self._lidar = lidar
        self._rays = rays
        self._seed = seed
        self.rate = lidar.rate
        angles = lidar.angles()
        in_laser = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)
        self.fan = RayFan(in_laser, lidar.mount.matrix())
        self._time_increment = round(NANOSECONDS / lidar.rate / lidar.samples) if lidar.rolling else 0
        self._ages = np.arange(lidar.samples - 1, -1, -1) * self._time_increment
        self.reset(0)

    @classmethod
    def fitted(cls, lidar: Lidar2D, surroundings: Surroundings) -> Self:
        """As a robot carries it through a world."""
        return cls(lidar, surroundings.rays_of(surroundings.imperfections.lidar_2d), surroundings.seed)

    def reset(self, count: int) -> None:
        """Fresh noise stream after the count-th reset."""
        self._noise = stream(self._seed, "lidar_2d/range_noise", count)

    def measure(self, stamp: int, motion: Motion) -> LaserScan:
        """The scan whose last ray is fired at `stamp`.

        A hit nearer than range_min or farther than range_max is +inf: no return.
        """
        lidar = self._lidar
        poses = motion.pose_at(stamp - self._ages if self._time_increment else [stamp])
        true = self._rays.distances(*self.fan.at(poses))
        key = np.uint64(next_key(self._noise))
        ranges = _measure(true, key, QUANTILES, lidar.noise, lidar.resolution, lidar.range_min, lidar.range_max)
        return LaserScan(
            stamp,
            ranges,
            lidar.angle_min,
            lidar.angle_increment,
            lidar.range_min,
            lidar.range_max,
            self._time_increment,
        )


@njit(cache=True)
def _measure(true, key, quantiles, sigma, resolution, range_min, range_max):  # type: ignore[no-untyped-def]
    """(N,) float32 readings from true distances: noise, resolution, then the limits."""
    noise = drawn(key, quantiles, len(true))
    ranges = np.empty(len(true), np.float32)
    for i in range(len(true)):
        if not range_min <= true[i] <= range_max:
            ranges[i] = np.inf
            continue
        reading = true[i] + sigma * noise[i]
        if resolution > 0.0:
            reading = round(reading / resolution) * resolution
        ranges[i] = min(max(reading, range_min), range_max)
    return ranges
