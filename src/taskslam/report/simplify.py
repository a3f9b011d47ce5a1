"""Fewer points for the same line."""

from __future__ import annotations

import numpy as np

from taskslam.geometry import FloatArray


def simplified(points: FloatArray, tolerance: float) -> FloatArray:
    """The (K, 2) of (N, 2) points that keep an open line within `tolerance` of where it was; both ends stay.

    Douglas and Peucker, "Algorithms for the reduction of the number of points required to represent a digitized line"
    (1973), with a list of open stretches in place of recursion.
    """
    kept = np.zeros(len(points), dtype=np.bool_)
    kept[[0, -1]] = True
    stretches = [(0, len(points) - 1)]
    while stretches:
        first, last = stretches.pop()
        if last - first < 2:
            continue
        away = _distances(points[first + 1 : last], points[first], points[last])
        farthest = int(np.argmax(away))
        if away[farthest] > tolerance:
            middle = first + 1 + farthest
            kept[middle] = True
            stretches += [(first, middle), (middle, last)]
    return points[kept]


def _distances(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """(N,) distances of (N, 2) points to the segment from start to end: a line may turn back beyond its ends."""
    along = end - start
    length = float(along @ along)
    share = np.clip((points - start) @ along / length, 0.0, 1.0) if length > 0 else np.zeros(len(points))
    offsets = points - start - share[:, None] * along
    return np.asarray(np.hypot(offsets[:, 0], offsets[:, 1]))
