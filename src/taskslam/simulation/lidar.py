"""The planar LiDAR: rays by Embree, range limits and noise as Gazebo's ray sensors have them (protocol 4.2)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS, LaserScan
from taskslam.robot import Lidar2D
from taskslam.simulation.raytracing import RayCaster
from taskslam.simulation.streams import stream


class LaserScanner:
    """Turns true base poses into scans. The mount may be pitched or rolled; the base stays level."""

    def __init__(self, lidar: Lidar2D, rays: RayCaster, seed: int) -> None:
        self._lidar = lidar
        self._rays = rays
        self._seed = seed
        angles = lidar.angles()
        T_base_laser = lidar.mount.matrix()
        in_laser = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)
        self._directions_base = in_laser @ T_base_laser[:3, :3].T
        self._origin_base = T_base_laser[:3, 3]
        self.time_increment = round(NANOSECONDS / lidar.rate / lidar.samples) if lidar.rolling else 0
        self.reset(0)

    def reset(self, count: int) -> None:
        """Fresh noise stream after the count-th reset."""
        self._noise = stream(self._seed, "lidar_2d/range_noise", count)

    def scan(self, stamp: int, poses: FloatArray) -> LaserScan:
        """One scan. poses: (1, 3) true base pose in `map` for an instant scan, (samples, 3), one per ray, if rolling.

        A hit nearer than range_min or farther than range_max is +inf: no return.
        """
        origins, directions = self.rays(poses)
        true = self._rays.distances(origins, directions)
        lidar = self._lidar
        noise = self._noise.standard_normal(lidar.samples, dtype=np.float32)
        ranges = _measure(true, noise, lidar.noise, lidar.resolution, lidar.range_min, lidar.range_max)
        return LaserScan(
            stamp,
            ranges,
            lidar.angle_min,
            lidar.angle_increment,
            lidar.range_min,
            lidar.range_max,
            self.time_increment,
        )

    def rays(self, poses: FloatArray) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
        """(samples, 3) float32 origins and unit directions in `map` for one pose, or one pose per ray."""
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        d, o = self._directions_base, self._origin_base
        directions = np.empty((self._lidar.samples, 3), np.float32)
        directions[:, 0] = c * d[:, 0] - s * d[:, 1]
        directions[:, 1] = s * d[:, 0] + c * d[:, 1]
        directions[:, 2] = d[:, 2]
        origins = np.empty_like(directions)
        origins[:, 0] = poses[:, 0] + c * o[0] - s * o[1]
        origins[:, 1] = poses[:, 1] + s * o[0] + c * o[1]
        origins[:, 2] = o[2]
        return origins, directions


@njit(cache=True)
def _measure(true, noise, sigma, resolution, range_min, range_max):  # type: ignore[no-untyped-def]
    """(N,) float32 readings from true distances and standard normal draws: noise, resolution, then the limits."""
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
