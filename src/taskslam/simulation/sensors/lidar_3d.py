"""The spinning LiDAR (VLP-16 by default): rings, per-point time, range limits and noise (protocol 4.4)."""

from __future__ import annotations

from typing import Self

import numpy as np

from taskslam.compiled import njit
from taskslam.measurements import NANOSECONDS, PointCloud, Sensor
from taskslam.robot import Lidar3D
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.counted_noise import QUANTILES, drawn, next_key
from taskslam.simulation.sensors.faint_rays import FaintRays
from taskslam.simulation.sensors.ray_fan import RayFan
from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.simulation.sensors.simulated_sensor import Surroundings
from taskslam.simulation.streams import stream


class SpinningLidar:
    """One turn per period. Rays stand ring by ring, lowest first; within a ring by azimuth, -pi first."""

    sensor = Sensor.POINT_CLOUD

    def __init__(self, lidar: Lidar3D, rays: RayCaster | FaintRays, seed: int) -> None:
        self._lidar = lidar
        self._rays = rays
        self._seed = seed
        self.rate = lidar.rate
        elevations = np.linspace(lidar.elevation_min, lidar.elevation_max, lidar.rings)
        azimuths = -np.pi + 2.0 * np.pi / lidar.samples * np.arange(lidar.samples)
        elevation, azimuth = (grid.ravel() for grid in np.meshgrid(elevations, azimuths, indexing="ij"))
        self._directions = np.stack(
            [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=1
        )
        self.fan = RayFan(self._directions, lidar.mount.matrix())
        self._ring = np.repeat(np.arange(lidar.rings, dtype=np.uint16), lidar.samples)
        ages = (lidar.samples - 1 - np.arange(lidar.samples)) * (NANOSECONDS / lidar.rate / lidar.samples)
        self._sweep = -np.round(ages).astype(np.int32) if lidar.rolling else np.zeros(lidar.samples, np.int32)
        self._offsets = np.tile(self._sweep, lidar.rings)
        self.reset(0)

    @classmethod
    def fitted(cls, lidar: Lidar3D, surroundings: Surroundings) -> Self:
        """As a robot carries it through a world."""
        return cls(lidar, surroundings.rays_of(surroundings.imperfections.lidar_3d), surroundings.seed)

    def reset(self, count: int) -> None:
        """Fresh noise stream after the count-th reset."""
        self._noise = stream(self._seed, "lidar_3d/range_noise", count)

    def measure(self, stamp: int, motion: Motion) -> PointCloud:
        """The turn that ends at `stamp`; points in the LiDAR frame of each firing's own instant."""
        lidar = self._lidar
        if lidar.rolling:
            poses = np.tile(motion.pose_at(stamp + self._sweep.astype(np.int64)), (lidar.rings, 1))
        else:
            poses = motion.pose_at([stamp])
        ranges = self._rays.distances(*self.fan.at(poses))
        key, limits = np.uint64(next_key(self._noise)), (lidar.range_min, lidar.range_max)
        points, kept = _points(ranges, key, QUANTILES, self._directions, lidar.noise, *limits)
        return PointCloud(stamp, points, self._ring[kept], self._offsets[kept])


@njit(cache=True)
def _points(true, key, quantiles, directions, sigma, range_min, range_max):  # type: ignore[no-untyped-def]
    """(K, 3) float32 points of the rays that return, and their (K,) indices."""
    noise = drawn(key, quantiles, len(true))
    points, kept = np.empty((len(true), 3), np.float32), np.empty(len(true), np.int64)
    count = 0
    for i in range(len(true)):
        if range_min <= true[i] <= range_max:
            reading = true[i] + sigma * noise[i]
            for axis in range(3):
                points[count, axis] = reading * directions[i, axis]
            kept[count] = i
            count += 1
    return points[:count].copy(), kept[:count].copy()
