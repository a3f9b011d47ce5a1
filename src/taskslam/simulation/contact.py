"""The bumper: does the robot's cylinder touch collision geometry between its ground clearance and its height?

The triangles are clipped to that slab once and projected to convex polygons; a uniform grid then names the few
polygons near a position, and the test is the exact distance from the robot's axis to them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.robot import Footprint
from taskslam.world import World
from taskslam.world.slicing import slab_polygons

_CELL = 0.25  # m; a few polygons per cell at the robot's size


@dataclass(frozen=True)
class ContactGrid:
    """Polygons by grid cell. first: (rows * columns + 1,) offsets into members, polygon indices.

    points: (P, 2) corners; offsets: (K + 1,) first corner of each polygon.
    """

    points: npt.NDArray[np.float64]
    offsets: npt.NDArray[np.int64]
    first: npt.NDArray[np.int64]
    members: npt.NDArray[np.int64]
    x0: float
    y0: float
    rows: int
    columns: int
    radius: float

    def touches(self, x: float, y: float) -> bool:
        """Whether the robot's axis at (x, y) in `map` is closer to an obstacle than its radius."""
        return bool(touches(self.points, self.offsets, self.first, self.members, *self.frame(), x, y))

    def frame(self) -> tuple[float, float, int, int, float]:
        """Lower-left corner (m), rows, columns, radius: what the kernel needs beside the arrays."""
        return self.x0, self.y0, self.rows, self.columns, self.radius


def contact_grid(world: World, footprint: Footprint) -> ContactGrid:
    """Prepare a world's collision geometry for contact with a robot of this footprint."""
    points, offsets = slab_polygons(world.collision, footprint.ground_clearance, footprint.height)
    if len(offsets) < 2:
        points, offsets = np.full((1, 2), 1e9), np.array([0, 1])
    low = np.minimum.reduceat(points, offsets[:-1], axis=0) - footprint.radius
    high = np.maximum.reduceat(points, offsets[:-1], axis=0) + footprint.radius
    x0, y0 = low.min(axis=0)
    columns, rows = np.floor((high.max(axis=0) - (x0, y0)) / _CELL).astype(int) + 1
    first_cell = np.floor((low - (x0, y0)) / _CELL).astype(np.int64)
    last_cell = np.floor((high - (x0, y0)) / _CELL).astype(np.int64)
    first, members = _bucket(points, offsets, first_cell, last_cell, int(rows), int(columns), x0, y0, footprint.radius)
    return ContactGrid(points, offsets, first, members, float(x0), float(y0), int(rows), int(columns), footprint.radius)


@njit(cache=True)
def _bucket(points, offsets, first_cell, last_cell, rows, columns, x0, y0, radius):  # type: ignore[no-untyped-def]
    """Counting sort of polygons into the cells that they can be touched from."""
    reach = radius + _CELL * math.sqrt(0.5)
    first = np.zeros(rows * columns + 1, np.int64)
    members = np.empty(0, np.int64)
    for fill in range(2):
        cursor = first.copy()
        for k in range(len(offsets) - 1):
            for row in range(first_cell[k, 1], last_cell[k, 1] + 1):
                for column in range(first_cell[k, 0], last_cell[k, 0] + 1):
                    cx, cy = x0 + (column + 0.5) * _CELL, y0 + (row + 0.5) * _CELL
                    if polygon_distance(points, offsets[k], offsets[k + 1], cx, cy) > reach:
                        continue
                    cell = row * columns + column
                    if fill == 0:
                        first[cell + 1] += 1
                    else:
                        members[cursor[cell]] = k
                        cursor[cell] += 1
        if fill == 0:
            first = np.cumsum(first)
            members = np.empty(first[-1], np.int64)
    return first, members


@njit(cache=True)
def polygon_distance(points, start, end, x, y):  # type: ignore[no-untyped-def]
    """Distance from (x, y) to a convex polygon (or segment, or point); 0 inside."""
    best = 1e300
    positive, negative = False, False
    for i in range(start, end):
        j = i + 1 if i + 1 < end else start
        ax, ay = points[i, 0], points[i, 1]
        dx, dy = points[j, 0] - ax, points[j, 1] - ay
        px, py = x - ax, y - ay
        length2 = dx * dx + dy * dy
        t = 0.0 if length2 == 0.0 else min(1.0, max(0.0, (px * dx + py * dy) / length2))
        best = min(best, (px - t * dx) ** 2 + (py - t * dy) ** 2)
        cross = dx * py - dy * px
        positive = positive or cross > 0.0
        negative = negative or cross < 0.0
    if end - start >= 3 and positive != negative:
        return 0.0
    return math.sqrt(best)


@njit(cache=True)
def touches(points, offsets, first, members, x0, y0, rows, columns, radius, x, y):  # type: ignore[no-untyped-def]
    """Whether any polygon near (x, y) is closer than `radius`."""
    column, row = math.floor((x - x0) / _CELL), math.floor((y - y0) / _CELL)
    if column < 0 or row < 0 or column >= columns or row >= rows:
        return False
    cell = row * columns + column
    for m in range(first[cell], first[cell + 1]):
        k = members[m]
        if polygon_distance(points, offsets[k], offsets[k + 1], x, y) < radius:
            return True
    return False
