"""What of a world lies between two heights, seen from above: as convex polygons, and as a floor plan.

The bumper and the sliced floor plan use the same polygons, so that a plan says free exactly where the robot fits.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from taskslam.geometry import FloatArray
from taskslam.world.world import TriangleMesh

_MOST_CORNERS = 5  # a triangle cut by two parallel planes
_FLAT = 1e-6  # m; a projection thinner than float32 resolution at 10 m is a segment


def slab_polygons(mesh: TriangleMesh, low: float, high: float) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Every triangle of `mesh` clipped exactly to low < z < high (world frame, m) and projected to the floor.

    Returns points (P, 2) float64, x and y in metres, and offsets (K + 1,) int64: polygon k is
    `points[offsets[k]:offsets[k + 1]]`, convex, counter-clockwise, with 3 to 5 corners, or 2 where the projection is a
    segment (vertical surfaces). Order follows the mesh. Triangles that only touch the slab from outside give none.

    Clipping: Sutherland and Hodgman 1974, on the two planes z = low and z = high.

    Raises:
        ValueError: `low` is not below `high`.

    """
    if not low < high:
        raise ValueError(f"a slab needs low < high, got low = {low} m and high = {high} m")
    z = mesh.vertices[:, 2].astype(np.float64)[mesh.triangles]
    within = (z.max(axis=1) > low) & (z.min(axis=1) < high)
    corners = mesh.vertices[mesh.triangles[within]].astype(np.float64)
    points, offsets = _clip_all(corners, float(low), float(high))
    return points, offsets


@njit(cache=True)
def _clip_all(corners: FloatArray, low: float, high: float) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    count = corners.shape[0]
    points = np.empty((count * _MOST_CORNERS, 2))
    offsets = np.zeros(count + 1, np.int64)
    polygons = 0
    total = 0
    a = np.empty((_MOST_CORNERS, 3))
    b = np.empty((_MOST_CORNERS, 3))
    for t in range(count):
        a[:3] = corners[t]
        n = _clip(a, 3, b, low, 1.0)
        n = _clip(b, n, a, high, -1.0)
        n = _project(a, n, points, total)
        if n > 0:
            total += n
            polygons += 1
            offsets[polygons] = total
    return points[:total].copy(), offsets[: polygons + 1].copy()


@njit(cache=True)
def _clip(source: FloatArray, n: int, target: FloatArray, height: float, sign: float) -> int:
    """Keep the part of a polygon with sign * (z - height) >= 0; returns its number of corners."""
    kept = 0
    for i in range(n):
        j = (i + 1) % n
        d_i = sign * (source[i, 2] - height)
        d_j = sign * (source[j, 2] - height)
        if d_i >= 0.0:
            target[kept] = source[i]
            kept += 1
        if (d_i > 0.0 and d_j < 0.0) or (d_i < 0.0 and d_j > 0.0):
            # always from the lower index of the pair in z, so that the shared edge of two triangles gives one point
            if d_i > 0.0:
                s = d_i / (d_i - d_j)
                p, q = i, j
            else:
                s = d_j / (d_j - d_i)
                p, q = j, i
            for axis in range(2):
                target[kept, axis] = source[p, axis] + s * (source[q, axis] - source[p, axis])
            target[kept, 2] = height
            kept += 1
    return kept


@njit(cache=True)
def _project(polygon: FloatArray, n: int, points: FloatArray, start: int) -> int:
    """Write the x, y projection of a clipped polygon from row `start` on; returns its corners (0: nothing is left)."""
    first, second, longest = 0, 0, 0.0
    for i in range(n):
        for j in range(i + 1, n):
            length = (polygon[i, 0] - polygon[j, 0]) ** 2 + (polygon[i, 1] - polygon[j, 1]) ** 2
            if length > longest:
                first, second, longest = i, j, length
    if longest == 0.0:
        return 0
    longest = np.sqrt(longest)
    along_x = (polygon[second, 0] - polygon[first, 0]) / longest
    along_y = (polygon[second, 1] - polygon[first, 1]) / longest
    width = 0.0
    area = 0.0
    for i in range(n):
        j = (i + 1) % n
        across = along_x * (polygon[i, 1] - polygon[first, 1]) - along_y * (polygon[i, 0] - polygon[first, 0])
        width = max(width, abs(across))
        area += (polygon[i, 0] - polygon[0, 0]) * (polygon[j, 1] - polygon[0, 1])
        area -= (polygon[j, 0] - polygon[0, 0]) * (polygon[i, 1] - polygon[0, 1])
    if width < _FLAT:
        points[start, 0], points[start, 1] = polygon[first, 0], polygon[first, 1]
        points[start + 1, 0], points[start + 1, 1] = polygon[second, 0], polygon[second, 1]
        return 2
    for i in range(n):
        k = i if area > 0.0 else n - 1 - i
        points[start + i, 0], points[start + i, 1] = polygon[k, 0], polygon[k, 1]
    return n
