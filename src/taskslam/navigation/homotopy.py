"""Which ways past the obstacles there are, and when two bands go the same way (Roesmann et al. 2017).

Two paths with the same ends go the same way exactly if they wind equally about every obstacle. The winding angle about
one point inside each obstacle is the planar H-signature's phase; angles of equivalent paths agree, of others they
differ by whole turns. Obstacles between which the robot does not fit are one obstacle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy import ndimage

from taskslam.geometry import FloatArray
from taskslam.navigation.costmap import LocalCostmap, blocked
from taskslam.navigation.settings import TebSettings

_EIGHT_NEIGHBOURS = np.ones((3, 3), dtype=np.int8)
_MAX_KEYPOINTS = 16
_MAX_VISITS = 300


@dataclass(frozen=True, slots=True)
class ObstacleMap:
    """The local costmap's obstacles grown by the robot's radius.

    labels: (n, n) int32, 0 where the robot's centre may be; inside: (count, 2) one lethal point of each obstacle, m.
    """

    labels: npt.NDArray[np.int32]
    inside: FloatArray
    x0: float
    y0: float
    resolution: float

    @staticmethod
    def of(costmap: LocalCostmap) -> ObstacleMap:
        """Label the obstacles of a local costmap (frame `odom`)."""
        labels, count = ndimage.label(blocked(costmap.cost), _EIGHT_NEIGHBOURS)
        x0, y0 = costmap.origin
        labels = labels.astype(np.int32, copy=False)
        inside = _points_inside(labels, costmap.layers, count, x0, y0, costmap.resolution)
        return ObstacleMap(labels, inside, x0, y0, costmap.resolution)


def same_class(a: FloatArray, b: FloatArray) -> bool:
    """Whether two winding signatures (count,) belong to paths of one homotopy class."""
    return bool(np.all(np.abs(a - b) < math.pi))


@njit(cache=True)
def signature(points: FloatArray, n: int, inside: FloatArray) -> FloatArray:
    """(count,) winding angle in radians of the first n rows (x, y, ...) of `points` about each point of `inside`."""
    total = np.zeros(len(inside))
    for o in range(len(inside)):
        ax, ay = points[0, 0] - inside[o, 0], points[0, 1] - inside[o, 1]
        for i in range(1, n):
            bx, by = points[i, 0] - inside[o, 0], points[i, 1] - inside[o, 1]
            total[o] += math.atan2(ax * by - ay * bx, ax * bx + ay * by)
            ax, ay = bx, by
    return total


def alternative_paths(
    obstacles: ObstacleMap, start: tuple[float, float], goal: tuple[float, float], settings: TebSettings, limit: int
) -> list[FloatArray]:
    """Up to `limit` polylines (K, 2) from start to goal through keypoints left and right of the obstacles between.

    The left-right-keypoint graph of Roesmann et al. 2017: edges lead towards the goal and are free of obstacles; a
    depth-first search in order of distance along the way lists its paths. Equivalent ones may repeat: ask `signature`.
    """
    length = math.hypot(goal[0] - start[0], goal[1] - start[1])
    if length < 2 * settings.min_obstacle_dist or len(obstacles.inside) == 0:
        return []
    points = _keypoints(
        obstacles.labels, len(obstacles.inside), *start, *goal, obstacles.x0, obstacles.y0, obstacles.resolution,
        settings.obstacle_keypoint_offset,
    )  # fmt: skip
    if len(points) == 0:
        return []
    vertices = np.vstack([[start], points, [goal]])
    found, lengths = _search(
        vertices, obstacles.labels, obstacles.x0, obstacles.y0, obstacles.resolution,
        settings.obstacle_heading_threshold, limit,
    )  # fmt: skip
    return [vertices[found[i, : lengths[i]]] for i in range(len(lengths))]


@njit(cache=True)
def _points_inside(
    labels: npt.NDArray[np.int32], layers: npt.NDArray[np.uint8], count: int, x0: float, y0: float, resolution: float
) -> FloatArray:
    inside = np.zeros((count, 2))
    seen = np.zeros(count, np.bool_)
    for r in range(labels.shape[0]):
        for c in range(labels.shape[1]):
            k = labels[r, c] - 1
            if k >= 0 and not seen[k] and layers[r, c] == 254:
                seen[k] = True
                inside[k, 0], inside[k, 1] = x0 + (c + 0.5) * resolution, y0 + (r + 0.5) * resolution
    return inside


@njit(cache=True)
def _keypoints(
    labels: npt.NDArray[np.int32],
    count: int,
    sx: float,
    sy: float,
    gx: float,
    gy: float,
    x0: float,
    y0: float,
    resolution: float,
    offset: float,
) -> FloatArray:
    """(K, 2) points beside the extremes, across the way, of each obstacle between start and goal, in order along it."""
    length = math.hypot(gx - sx, gy - sy)
    ux, uy = (gx - sx) / length, (gy - sy) / length
    left, right = np.full(count, -np.inf), np.full(count, np.inf)
    left_along, right_along = np.zeros(count), np.zeros(count)
    rows, columns = labels.shape
    for r in range(rows):
        for c in range(columns):
            k = labels[r, c] - 1
            if k < 0:
                continue
            dx, dy = x0 + (c + 0.5) * resolution - sx, y0 + (r + 0.5) * resolution - sy
            along, across = ux * dx + uy * dy, ux * dy - uy * dx
            if along <= 0.0 or along >= length:
                continue
            if across > left[k]:
                left[k], left_along[k] = across, along
            if across < right[k]:
                right[k], right_along[k] = across, along
    points = np.empty((2 * count, 2))
    order = np.empty(2 * count)
    n = 0
    for k in range(count):
        for side in range(2):
            across = left[k] + offset if side == 0 else right[k] - offset
            along = left_along[k] if side == 0 else right_along[k]
            if not math.isfinite(across):
                continue
            px, py = sx + ux * along - uy * across, sy + uy * along + ux * across
            c, r = math.floor((px - x0) / resolution), math.floor((py - y0) / resolution)
            if c < 0 or r < 0 or c >= columns or r >= rows or labels[r, c] != 0:
                continue
            i = n
            while i > 0 and order[i - 1] > along:
                order[i] = order[i - 1]
                points[i] = points[i - 1]
                i -= 1
            order[i] = along
            points[i, 0], points[i, 1] = px, py
            n += 1
    return points[: min(n, _MAX_KEYPOINTS)].copy()


@njit(cache=True)
def _free_line(
    labels: npt.NDArray[np.int32], ax: float, ay: float, bx: float, by: float, x0: float, y0: float, resolution: float
) -> bool:
    steps = int(math.hypot(bx - ax, by - ay) / (0.5 * resolution)) + 1
    for k in range(steps + 1):
        f = k / steps
        c = math.floor((ax + f * (bx - ax) - x0) / resolution)
        r = math.floor((ay + f * (by - ay) - y0) / resolution)
        if c < 0 or r < 0 or c >= labels.shape[1] or r >= labels.shape[0] or labels[r, c] != 0:
            return False
    return True


@njit(cache=True)
def _search(
    vertices: FloatArray,
    labels: npt.NDArray[np.int32],
    x0: float,
    y0: float,
    resolution: float,
    heading_threshold: float,
    limit: int,
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    """Depth-first over the forward graph; returns vertex indices (paths, V), zero-padded, and their lengths (paths,)."""
    count = len(vertices)
    length = math.hypot(vertices[-1, 0] - vertices[0, 0], vertices[-1, 1] - vertices[0, 1])
    ux, uy = (vertices[-1, 0] - vertices[0, 0]) / length, (vertices[-1, 1] - vertices[0, 1]) / length
    state = np.zeros((count, count), np.int8)  # 0 not yet asked, 1 edge, 2 no edge
    paths = np.zeros((limit, count), np.int32)
    lengths = np.zeros(limit, np.int32)
    found = 0
    stack = np.zeros(count + 1, np.int32)
    next_child = np.zeros(count + 1, np.int32)
    depth = 0
    next_child[0] = 1
    visits = 0
    while depth >= 0 and found < limit and visits < _MAX_VISITS:
        i, j = stack[depth], next_child[depth]
        if j >= count:
            depth -= 1
            continue
        next_child[depth] = j + 1
        if state[i, j] == 0:
            dx, dy = vertices[j, 0] - vertices[i, 0], vertices[j, 1] - vertices[i, 1]
            forward = ux * dx + uy * dy > heading_threshold * math.hypot(dx, dy)
            free = forward and _free_line(
                labels, vertices[i, 0], vertices[i, 1], vertices[j, 0], vertices[j, 1], x0, y0, resolution
            )
            state[i, j] = 1 if free else 2
        if state[i, j] == 2:
            continue
        visits += 1
        depth += 1
        stack[depth] = j
        next_child[depth] = j + 1
        if j == count - 1:
            for k in range(depth + 1):
                paths[found, k] = stack[k]
            lengths[found] = depth + 1
            found += 1
            depth -= 1
    return paths[:found].copy(), lengths[:found].copy()
