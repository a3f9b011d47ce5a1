"""Making bands: from a polyline, and from the band of the last control step."""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray


@njit(cache=True)
def _turn(from_: float, to: float) -> float:
    return math.atan2(math.sin(to - from_), math.cos(to - from_))


@njit(cache=True)
def initial_band(
    path: FloatArray, theta_start: float, theta_goal: float, v: float, w: float, dt_ref: float, capacity: int
) -> tuple[FloatArray, int]:
    """A band along a polyline at constant speed: turn on the spot, drive, turn on the spot.

    path: (K, 2) points with K >= 2, m; v, w: speeds of the guess, m/s and rad/s. Returns z (capacity, 4) and n.
    A goal nearer than two steps gets a straight blend of both poses: driving off towards it would turn the robot away
    from the heading that it is about to need.
    """
    z = np.zeros((capacity, 4))
    along = np.zeros(len(path))
    for i in range(1, len(path)):
        along[i] = along[i - 1] + math.hypot(path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1])
    length = along[-1]
    step = v * dt_ref
    if length < 2.0 * step:
        turn = _turn(theta_start, theta_goal)
        duration = max(length / v, abs(turn) / w, 2.0 * dt_ref)
        m = max(math.ceil(duration / dt_ref), 2)
        for k in range(m + 1):
            f = k / m
            z[k, 0] = path[0, 0] + f * (path[-1, 0] - path[0, 0])
            z[k, 1] = path[0, 1] + f * (path[-1, 1] - path[0, 1])
            z[k, 2] = theta_start + f * turn
            z[k, 3] = duration / m
        return z, m + 1

    spare = capacity - 1 - 2 * (int(math.pi / (w * dt_ref)) + 2)
    m = min(max(math.ceil(length / step), 2), spare)
    points = np.empty((m + 1, 2))
    j = 0
    for k in range(m + 1):
        s = length * k / m
        while j < len(path) - 2 and along[j + 1] < s:
            j += 1
        span = along[j + 1] - along[j]
        f = min((s - along[j]) / span, 1.0) if span > 0.0 else 0.0
        points[k, 0] = path[j, 0] + f * (path[j + 1, 0] - path[j, 0])
        points[k, 1] = path[j, 1] + f * (path[j + 1, 1] - path[j, 1])

    n = 0
    heading = math.atan2(points[1, 1] - points[0, 1], points[1, 0] - points[0, 0])
    turn = _turn(theta_start, heading)
    steps = int(abs(turn) / (w * dt_ref))
    if steps == 0:
        z[0, 0], z[0, 1], z[0, 2], z[0, 3] = points[0, 0], points[0, 1], theta_start, length / m / v
        n = 1
    else:
        for k in range(steps + 1):
            z[n, 0], z[n, 1] = points[0, 0], points[0, 1]
            z[n, 2], z[n, 3] = theta_start + turn * k / steps, abs(turn) / steps / w
            n += 1
        z[n - 1, 3] = length / m / v
    for k in range(1, m + 1):
        if k < m:
            heading = math.atan2(points[k + 1, 1] - points[k, 1], points[k + 1, 0] - points[k, 0])
        z[n, 0], z[n, 1], z[n, 2], z[n, 3] = points[k, 0], points[k, 1], heading, length / m / v
        n += 1
    turn = _turn(heading, theta_goal)
    steps = int(abs(turn) / (w * dt_ref))
    for k in range(1, steps + 1):
        z[n - 1, 3] = abs(turn) / steps / w
        z[n, 0], z[n, 1], z[n, 2] = points[m, 0], points[m, 1], heading + turn * k / steps
        n += 1
    z[n - 1, 2] = theta_goal
    z[n - 1, 3] = 0.0
    return z, n


@njit(cache=True)
def warm_start(
    z: FloatArray, n: int, x: float, y: float, theta: float, gx: float, gy: float, gtheta: float, min_samples: int
) -> int:
    """Cut off what has been driven and move both ends to the new start and goal; returns the new n.

    The nearest of the first ten poses becomes the start; headings count as 0.2 m per radian so that a turn on the spot
    is cut too.
    """
    nearest, least = 0, np.inf
    for i in range(min(n - min_samples, 10) + 1):
        d = (z[i, 0] - x) ** 2 + (z[i, 1] - y) ** 2 + (0.2 * _turn(theta, z[i, 2])) ** 2
        if d < least:
            nearest, least = i, d
    if nearest > 0:
        for j in range(nearest, n):
            z[j - nearest] = z[j]
        n -= nearest
    z[0, 0], z[0, 1], z[0, 2] = x, y, theta
    z[n - 1, 0], z[n - 1, 1], z[n - 1, 2] = gx, gy, gtheta
    return n
