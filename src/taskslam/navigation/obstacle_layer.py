"""The obstacle layer's two kernels, and how a scan is placed in a grid.

A hit marks its cell when it is near enough; the ray towards it clears the cells before it. Rays without a hit do
neither (`inf_is_valid` false, protocol 3.3). All clearing of a scan comes before its marking, as in costmap_2d,
so a ray that passes a wall at a grazing angle cannot erase what its neighbour has just seen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import SE2, FloatArray
from taskslam.measurements import LaserScan

Grid = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class PlacedScan:
    """A scan and where it was taken: `T_odom_laser` and `T_map_laser` at its stamp, as localization knew them then."""

    T_odom_laser: SE2
    T_map_laser: SE2
    angles: FloatArray
    ranges: FloatArray

    @staticmethod
    def of(scan: LaserScan, T_map_odom: SE2, T_odom_base: SE2, T_base_laser: SE2) -> PlacedScan:
        """Keep the hits of a scan; the sensor is taken as still during a turn."""
        ranges, hit = np.asarray(scan.ranges, dtype=np.float64), scan.hits()
        T_odom_laser = T_odom_base @ T_base_laser
        return PlacedScan(T_odom_laser, T_map_odom @ T_odom_laser, scan.angles()[hit], ranges[hit])


@njit(cache=True)
def clear_and_mark(
    marks: Grid,
    x: float,
    y: float,
    theta: float,
    angles: FloatArray,
    ranges: FloatArray,
    resolution: float,
    obstacle_range: float,
    raytrace_range: float,
    margin: float,
) -> None:
    """Update `marks` (rows, columns; 254 occupied, 0 free) with hits seen from (x, y, theta) in the grid's frame, m.

    margin: how far before a hit clearing ends, m (the VoxelLayer of costmap_2d keeps two cells).
    """
    rows, columns = marks.shape
    u0, v0 = x / resolution, y / resolution
    for i in range(len(ranges)):
        reach = min(ranges[i] - margin, raytrace_range) / resolution
        if reach <= 0.0:
            continue
        du, dv = math.cos(theta + angles[i]) * reach, math.sin(theta + angles[i]) * reach
        steps = int(max(abs(du), abs(dv))) + 1
        du /= steps
        dv /= steps
        for k in range(steps + 1):
            c, r = math.floor(u0 + k * du), math.floor(v0 + k * dv)
            if c < 0 or r < 0 or c >= columns or r >= rows:
                break
            marks[r, c] = 0
    for i in range(len(ranges)):
        if ranges[i] >= obstacle_range:
            continue
        c = math.floor(u0 + math.cos(theta + angles[i]) * ranges[i] / resolution)
        r = math.floor(v0 + math.sin(theta + angles[i]) * ranges[i] / resolution)
        if 0 <= c < columns and 0 <= r < rows:
            marks[r, c] = 254


@njit(cache=True)
def clear_disc(marks: Grid, x: float, y: float, radius: float, resolution: float) -> None:
    """Free the cells under the robot at x, y (costmap_2d `footprint_clearing_enabled`, on by default)."""
    rows, columns = marks.shape
    u, v, reach = x / resolution, y / resolution, radius / resolution
    for r in range(max(math.floor(v - reach), 0), min(math.floor(v + reach) + 1, rows)):
        for c in range(max(math.floor(u - reach), 0), min(math.floor(u + reach) + 1, columns)):
            if (c + 0.5 - u) ** 2 + (r + 0.5 - v) ** 2 <= reach * reach:
                marks[r, c] = 0
