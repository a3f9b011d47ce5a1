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
from scipy import ndimage

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.navigation.costmap import LocalCostmap, blocked
from taskslam.navigation.settings import TebSettings

_EIGHT_NEIGHBOURS = np.ones((3, 3), dtype=np.int8)
_MAX_CORNERS = 24


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
        labels = np.empty(costmap.cost.shape, np.int32)
        count = ndimage.label(blocked(costmap.cost), _EIGHT_NEIGHBOURS, output=labels)
        x0, y0 = costmap.origin
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


def distinct_paths(
    obstacles: ObstacleMap, start: tuple[float, float], goal: tuple[float, float], settings: TebSettings, round_: int
) -> list[FloatArray]:
    """Up to `max_classes` polylines (K, 2) from start to goal, each of another class, the shortest first.

    A roadmap as in Roesmann et al. 2017, `simple_exploration` off: samples between start and goal, edges that lead
    towards the goal and are free of obstacles. Two things differ. The samples are a Halton sequence, another stretch of
    it in each `round_`, so that runs repeat; corner points about each obstacle join them. And instead of listing all
    paths and comparing afterwards, the search keeps the shortest path of each class at each vertex.
    """
    length = math.hypot(goal[0] - start[0], goal[1] - start[1])
    if length < 2 * settings.min_obstacle_dist or len(obstacles.inside) == 0:
        return []
    vertices = _vertices(
        obstacles.labels, len(obstacles.inside), *start, *goal, obstacles.x0, obstacles.y0, obstacles.resolution,
        settings.obstacle_keypoint_offset, settings.roadmap_graph_area_width, settings.roadmap_graph_no_samples, round_,
    )  # fmt: skip
    paths, lengths = _shortest_of_each_class(
        vertices, obstacles.labels, obstacles.inside, obstacles.x0, obstacles.y0, obstacles.resolution,
        settings.obstacle_heading_threshold, settings.max_classes,
    )  # fmt: skip
    return [vertices[paths[i, : lengths[i]]] for i in range(len(lengths))]


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
def _halton(index: int, base: int) -> float:
    value, share = 0.0, 1.0
    while index > 0:
        share /= base
        value += share * (index % base)
        index //= base
    return value


@njit(cache=True)
def _vertices(
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
    width: float,
    samples: int,
    round_: int,
) -> FloatArray:
    """(V, 2) free points in order along the way: the start, corners about obstacles, samples, the goal."""
    length = math.hypot(gx - sx, gy - sy)
    ux, uy = (gx - sx) / length, (gy - sy) / length
    box = np.empty((count, 4))  # least and largest along, least and largest across the way
    for k in range(count):
        box[k] = np.array([np.inf, -np.inf, np.inf, -np.inf])
    rows, columns = labels.shape
    for r in range(rows):
        for c in range(columns):
            k = labels[r, c] - 1
            if k < 0:
                continue
            dx, dy = x0 + (c + 0.5) * resolution - sx, y0 + (r + 0.5) * resolution - sy
            along, across = ux * dx + uy * dy, ux * dy - uy * dx
            if along <= 0.0 or along >= length or abs(across) > 0.5 * width:
                continue
            box[k, 0], box[k, 1] = min(box[k, 0], along), max(box[k, 1], along)
            box[k, 2], box[k, 3] = min(box[k, 2], across), max(box[k, 3], across)

    wanted = np.empty((4 * count + samples, 2))
    n = 0
    for k in range(count):
        if box[k, 0] > box[k, 1]:
            continue
        for corner in range(4):
            wanted[n, 0] = box[k, 0] - offset if corner % 2 == 0 else box[k, 1] + offset
            wanted[n, 1] = box[k, 2] - offset if corner < 2 else box[k, 3] + offset
            n += 1
    n = min(n, _MAX_CORNERS)
    for k in range(samples):
        index = 1 + (round_ * samples + k) % 4096
        wanted[n, 0], wanted[n, 1] = length * _halton(index, 2), width * (_halton(index, 3) - 0.5)
        n += 1

    order = np.argsort(wanted[:n, 0], kind="mergesort")
    points = np.empty((n + 2, 2))
    points[0, 0], points[0, 1] = sx, sy
    kept = 1
    for i in order:
        along, across = wanted[i, 0], wanted[i, 1]
        if along <= 0.0 or along >= length:
            continue
        px, py = sx + ux * along - uy * across, sy + uy * along + ux * across
        c, r = math.floor((px - x0) / resolution), math.floor((py - y0) / resolution)
        if c < 0 or r < 0 or c >= columns or r >= rows or labels[r, c] != 0:
            continue
        points[kept, 0], points[kept, 1] = px, py
        kept += 1
    points[kept, 0], points[kept, 1] = gx, gy
    return points[: kept + 1].copy()


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
def _shortest_of_each_class(
    vertices: FloatArray,
    labels: npt.NDArray[np.int32],
    inside: FloatArray,
    x0: float,
    y0: float,
    resolution: float,
    heading_threshold: float,
    limit: int,
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    """Vertex indices (paths, V) and their counts (paths,): the `limit` shortest paths of different classes.

    Dynamic programming over (vertex, class) in the order of the vertices, which every edge respects.
    """
    count = len(vertices)
    length = math.hypot(vertices[-1, 0] - vertices[0, 0], vertices[-1, 1] - vertices[0, 1])
    ux, uy = (vertices[-1, 0] - vertices[0, 0]) / length, (vertices[-1, 1] - vertices[0, 1]) / length
    winding = np.zeros((count, limit, len(inside)))
    cost = np.full((count, limit), np.inf)
    from_vertex = np.zeros((count, limit), np.int32)
    from_slot = np.zeros((count, limit), np.int32)
    used = np.zeros(count, np.int32)
    used[0] = 1
    cost[0, 0] = 0.0
    edge = np.empty((2, 2))
    total = np.empty(len(inside))
    for j in range(1, count):
        for i in range(j):
            if used[i] == 0:
                continue
            dx, dy = vertices[j, 0] - vertices[i, 0], vertices[j, 1] - vertices[i, 1]
            distance = math.hypot(dx, dy)
            if ux * dx + uy * dy <= heading_threshold * distance:
                continue
            if not _free_line(
                labels, vertices[i, 0], vertices[i, 1], vertices[j, 0], vertices[j, 1], x0, y0, resolution
            ):
                continue
            edge[0] = vertices[i]
            edge[1] = vertices[j]
            turned = signature(edge, 2, inside)
            for a in range(used[i]):
                total[:] = winding[i, a] + turned
                reach = cost[i, a] + distance
                slot = -1
                for b in range(used[j]):
                    if np.all(np.abs(winding[j, b] - total) < math.pi):
                        slot = b
                        break
                if slot < 0:
                    if used[j] < limit:
                        slot = used[j]
                        used[j] += 1
                    else:
                        slot = int(np.argmax(cost[j]))
                if reach < cost[j, slot]:
                    cost[j, slot] = reach
                    winding[j, slot] = total
                    from_vertex[j, slot], from_slot[j, slot] = i, a
    found = used[count - 1]
    order = np.argsort(cost[count - 1, :found], kind="mergesort")
    paths = np.zeros((found, count), np.int32)
    counts = np.zeros(found, np.int32)
    backwards = np.empty(count, np.int32)
    for k in range(found):
        vertex, slot, n = count - 1, order[k], 0
        while vertex != 0:
            backwards[n] = vertex
            n += 1
            vertex, slot = from_vertex[vertex, slot], from_slot[vertex, slot]
        backwards[n] = 0
        n += 1
        for i in range(n):
            paths[k, i] = backwards[n - 1 - i]
        counts[k] = n
    return paths, counts
