"""A laser scan as points of surfaces in the base frame: hits, each with the direction that its surface faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.measurements import LaserScan

Points = npt.NDArray[np.float64] | npt.NDArray[np.float32]

_REACH = 0.12  # metres of neighbouring hits on either side that tell a hit's surface direction
_MAXIMUM_NEIGHBOURS = 24


@dataclass(frozen=True, slots=True)
class ScanPoints:
    """Hits of one scan in the base frame.

    points: (N, 2) metres. normals: (N, 2) unit vectors off the surface towards the sensor; zero where the neighbours do
    not form a line. sensor: (2,) position of the laser.
    """

    points: Points
    normals: Points
    sensor: FloatArray

    def __len__(self) -> int:
        return len(self.points)


def scan_to_points(
    scan: LaserScan, T_base_laser: FloatArray, max_range: float, motion: FloatArray | None = None
) -> ScanPoints:
    """Hits of a scan within max_range metres, in the base frame of the scan's stamp.

    T_base_laser: (4, 4) mount. motion: (number of rays, 3) pose of the base at each ray's instant seen from the base at
    the stamp, to deskew a rolling scan; None for an instant scan.
    """
    ranges = np.asarray(scan.ranges, dtype=np.float64)
    hit = scan.hits() & (ranges < max_range)
    angles = scan.angles()[hit]
    r = ranges[hit]
    x, y = r * np.cos(angles), r * np.sin(angles)
    # Written out: a matrix product of this size may be split among threads, and then round otherwise.
    T = T_base_laser
    points = np.stack([T[0, 0] * x + T[0, 1] * y + T[0, 3], T[1, 0] * x + T[1, 1] * y + T[1, 3]], axis=1)
    if motion is not None:
        pose = motion[hit]
        c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        points = np.stack(
            [
                c * points[:, 0] - s * points[:, 1] + pose[:, 0],
                s * points[:, 0] + c * points[:, 1] + pose[:, 1],
            ],
            axis=1,
        )
    sensor = np.array(T_base_laser[:2, 3], dtype=np.float64)
    whole_turn = abs(scan.angle_increment) * len(ranges) > 2 * np.pi - 0.05
    return ScanPoints(points, _surface_normals(points, sensor, whole_turn), sensor)


@njit(cache=True)
def _surface_normals(points: FloatArray, sensor: FloatArray, whole_turn: bool) -> FloatArray:
    """(N, 2) normals by a line fit through the neighbouring hits within reach; zero where they form no line."""
    n = points.shape[0]
    normals = np.zeros((n, 2))
    for i in range(n):
        px, py = points[i, 0], points[i, 1]
        # Far hits lie apart: their neighbours may be as far as a few gaps between rays at a slant.
        distance = np.hypot(px - sensor[0], py - sensor[1])
        reach = max(_REACH, 0.04 * distance)
        count, mx, my = 1.0, 0.0, 0.0
        xx, xy, yy = 0.0, 0.0, 0.0
        for side in (-1, 1):
            for k in range(1, _MAXIMUM_NEIGHBOURS + 1):
                j = i + side * k
                if whole_turn:
                    j = j % n
                elif j < 0 or j >= n:
                    break
                dx, dy = points[j, 0] - px, points[j, 1] - py
                if dx * dx + dy * dy > reach * reach:
                    break
                count += 1.0
                mx += dx
                my += dy
                xx += dx * dx
                xy += dx * dy
                yy += dy * dy
        if count < 4.0:
            continue
        mx /= count
        my /= count
        cxx, cxy, cyy = xx / count - mx * mx, xy / count - mx * my, yy / count - my * my
        half = 0.5 * (cxx + cyy)
        root = np.sqrt(0.25 * (cxx - cyy) ** 2 + cxy * cxy)
        smaller = half - root
        larger = half + root
        if larger <= 0.0 or smaller > 0.3 * larger:
            continue
        angle = 0.5 * np.arctan2(2 * cxy, cxx - cyy)  # direction of the surface
        nx, ny = -np.sin(angle), np.cos(angle)
        if nx * (sensor[0] - px) + ny * (sensor[1] - py) < 0.0:
            nx, ny = -nx, -ny
        normals[i, 0] = nx
        normals[i, 1] = ny
    return normals


@njit(cache=True)
def thin(points: Points, spacing: float) -> npt.NDArray[np.int64]:
    """Indices of a subset in which neighbours in scan order lie at least `spacing` metres apart."""
    kept = np.empty(points.shape[0], np.int64)
    count = 0
    x, y = np.inf, np.inf
    for i in range(points.shape[0]):
        dx, dy = points[i, 0] - x, points[i, 1] - y
        if count == 0 or dx * dx + dy * dy >= spacing * spacing:
            x, y = points[i, 0], points[i, 1]
            kept[count] = i
            count += 1
    return kept[:count].copy()
