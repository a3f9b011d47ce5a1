"""What of a world lies between two heights, seen from above: as convex polygons, and as a floor plan.

The bumper and the sliced floor plan use the same polygons, so that a plan says free exactly where the robot fits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from taskslam.compiled import njit
from taskslam.errors import FloorPlanError
from taskslam.geometry import SE2, FloatArray
from taskslam.reading import MOST_CELLS
from taskslam.world.floor_plan import FREE, OCCUPIED, UNKNOWN, FloorPlan
from taskslam.world.world import TriangleMesh, World

_AROUND = 1.0  # m of floor around a goal outside the walls
_MARGIN = 2  # cells around the outermost obstacle
_FARTHEST = 1e15  # cells from the origin, which doubles count exactly
_MOST_CORNERS = 5  # a triangle cut by two parallel planes
_FLAT = 1e-6  # m; a projection thinner than float32 resolution at 10 m is a segment


def slice_floor_plan(
    world: World,
    low: float,
    high: float,
    resolution: float = 0.05,
    seed_point: tuple[float, float] | None = None,
    geometry: Literal["collision", "visual"] = "collision",
    reach: Sequence[tuple[float, float]] = (),
) -> FloorPlan:
    """Draw the floor plan of everything in `world` with low < z < high (m above the world's origin).

    A cell is OCCUPIED when any surface in the slab touches it, and else FREE. With `seed_point` (x, y in metres, for
    example the start pose) only cells connected to it (4-neighbours) are FREE; the rest is UNKNOWN: the inside of
    solid things, and what lies outside the building. A point of `reach` (x, y in metres: a goal) that lies outside the
    walls extends the grid to a metre around it. The grid is aligned with the world's axes and its origin is a
    multiple of `resolution`, so that plans of the same world share cell borders.

    Raises:
        FloorPlanError: nothing lies in the slab, the plan would be unreasonably large, or the seed point is outside
            the plan or occupied.
        ValueError: `low` is not below `high`, or `resolution` is not positive.
    """
    if not resolution > 0:
        raise ValueError(f"resolution is {resolution}, expected metres per cell above 0")
    mesh = world.collision if geometry == "collision" else world.visual
    points, offsets = slab_polygons(mesh, low, high)
    if len(points) == 0:
        raise FloorPlanError(f"world {world.name}: no {geometry} geometry between {low} m and {high} m above the floor")
    low_corner, high_corner = points.min(axis=0), points.max(axis=0)
    for point in np.array(reach, dtype=np.float64).reshape(-1, 2):
        if (point < low_corner).any() or (point > high_corner).any():
            low_corner, high_corner = np.minimum(low_corner, point - _AROUND), np.maximum(high_corner, point + _AROUND)
    lowest, highest = np.floor(low_corner / resolution), np.floor(high_corner / resolution)
    # As doubles, because the corners of a world of any size in cells of any size need not fit into integers.
    columns, rows = (highest - lowest + 2 * _MARGIN + 1).tolist()
    if not (rows * columns <= MOST_CELLS and np.abs([lowest, highest]).max() < _FARTHEST):
        raise FloorPlanError(
            f"world {world.name}: a floor plan of {columns:g} x {rows:g} cells of {resolution} m is too large;"
            f" choose a coarser resolution or a slab above the ground"
        )
    first = lowest.astype(np.int64) - _MARGIN
    rows, columns = int(rows), int(columns)
    occupied = np.zeros((rows, columns), np.bool_)
    _rasterize(points / resolution - first, offsets, occupied)
    origin = SE2(float(first[0] * resolution), float(first[1] * resolution), 0.0)
    plan = FloorPlan(np.where(occupied, OCCUPIED, FREE).astype(np.uint8), resolution, origin)
    if seed_point is None:
        return plan
    try:
        return keep_connected(plan, seed_point)
    except FloorPlanError as error:
        raise FloorPlanError(f"world {world.name}, sliced between {low} m and {high} m: {error}") from error


def keep_connected(plan: FloorPlan, seed_point: tuple[float, float]) -> FloorPlan:
    """Return the plan with FREE cells only where they connect (4-neighbours) to a point x, y in `map`; others UNKNOWN.

    Raises:
        FloorPlanError: the point is outside the plan, occupied or unknown.

    """
    x, y = seed_point
    found = plan.at(x, y)
    if found != FREE:
        what = "occupied" if found == OCCUPIED else "unknown or outside the plan"
        raise FloorPlanError(f"the seed point ({x}, {y}) is {what}, expected free floor")
    regions, _ = ndimage.label(plan.cells == FREE)
    row, column = plan.cells_of(np.array([seed_point]))[0]
    hidden = (plan.cells == FREE) & (regions != regions[row, column])
    return FloorPlan(np.where(hidden, np.uint8(UNKNOWN), plan.cells), plan.resolution, plan.origin)


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


@njit(cache=True)
def _rasterize(points: FloatArray, offsets: npt.NDArray[np.int64], cells: npt.NDArray[np.bool_]) -> None:
    """Mark every cell that a convex polygon (corners in cell units) touches.

    Within one row of cells a convex polygon spans the x interval between the outermost points of its edges there.
    """
    rows = cells.shape[0]
    left = np.empty(rows)
    right = np.empty(rows)
    for polygon in range(offsets.shape[0] - 1):
        start, end = offsets[polygon], offsets[polygon + 1]
        bottom, top = points[start, 1], points[start, 1]
        for i in range(start + 1, end):
            bottom = min(bottom, points[i, 1])
            top = max(top, points[i, 1])
        first, last = math.floor(bottom), math.floor(top)
        left[first : last + 1] = np.inf
        right[first : last + 1] = -np.inf
        for i in range(start, end):
            j = i + 1 if i + 1 < end else start
            x0, y0, x1, y1 = points[i, 0], points[i, 1], points[j, 0], points[j, 1]
            if y0 > y1:
                x0, y0, x1, y1 = x1, y1, x0, y0
            for row in range(math.floor(y0), math.floor(y1) + 1):
                xa, xb = x0, x1
                if y0 < row:
                    xa = x0 + (row - y0) / (y1 - y0) * (x1 - x0)
                if y1 > row + 1:
                    xb = x0 + (row + 1 - y0) / (y1 - y0) * (x1 - x0)
                left[row] = min(left[row], xa, xb)
                right[row] = max(right[row], xa, xb)
        for row in range(first, last + 1):
            cells[row, math.floor(left[row]) : math.floor(right[row]) + 1] = True
