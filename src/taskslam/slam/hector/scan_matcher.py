"""Scan-to-map alignment by Gauss-Newton on the bilinearly interpolated map (Kohlbrecher et al. 2011, section IV.B).

With M(p) the probability that the map is occupied at p, and S_i(xi) the i-th hit of the scan seen from the pose
xi = (x, y, theta), the pose is moved to reduce sum_i (1 - M(S_i(xi)))^2; each step is

    dxi = H^-1 sum_i J_i^T (1 - M(S_i)),    J_i = grad M(S_i) dS_i/dxi,    H = sum_i J_i^T J_i.

It begins on the coarsest level, whose wide cells reach far, and goes on to the finest from where that one ended.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.hector.occupancy_grid import LogOdds, OccupancyGrid

# Information as of a measurement with deviations of 1 m and 1 rad: what the map leaves open stays where it was, and the
# Hessian can be inverted.
_REGULAR = 1.0
_LARGEST_TURN = 0.2  # radians in one step: the linearisation holds no further (hector_mapping's limit)


@dataclass(frozen=True, slots=True)
class Alignment:
    """pose: (3,). covariance: (3, 3), m^2 and rad^2.

    score: of the hits that fall where the map knows anything, the share that falls on what is rather occupied, 0..1.
    known: the share of hits that fall there.
    """

    pose: FloatArray
    covariance: FloatArray
    score: float
    known: float


def align(levels: Sequence[OccupancyGrid], points: FloatArray, start: FloatArray, coarse: int, fine: int) -> Alignment:
    """Align (N, 2) hits in the base frame with the map, finest level first in `levels`, from the pose `start` (3,).

    coarse, fine: Gauss-Newton steps on every coarser level and on the finest.
    """
    pose = start
    for number in range(len(levels) - 1, -1, -1):
        level = levels[number]
        pose, H, squares, hit, known = _gauss_newton(
            level.log_odds, level.origin, level.resolution, points, pose, fine if number == 0 else coarse
        )
    count = max(len(points), 1)
    # The covariance of least squares: the residuals tell the variance (the paper's sigma^2 H^-1).
    variance = squares / max(count - 3, 1)
    covariance = variance * np.linalg.inv(H)
    return Alignment(pose, 0.5 * (covariance + covariance.T), hit / max(known, 1), known / count)


@njit(cache=True)
def _gauss_newton(
    log_odds: LogOdds, origin: FloatArray, resolution: float, points: FloatArray, start: FloatArray, steps: int
) -> tuple[FloatArray, FloatArray, float, int, int]:
    """Pose, and as they were before the last step: Hessian, sum of squared residuals, hits on occupied and known."""
    rows, columns = log_odds.shape
    pose = start.copy()
    H = np.zeros((3, 3))
    squares, hit, known = 0.0, 0, 0
    for _ in range(steps):
        c, s = np.cos(pose[2]), np.sin(pose[2])
        H[:] = 0.0
        b = np.zeros(3)
        squares, hit, known = 0.0, 0, 0
        for p in range(points.shape[0]):
            rx = c * points[p, 0] - s * points[p, 1]
            ry = s * points[p, 0] + c * points[p, 1]
            # In cells between the centres of cells.
            x = (rx + pose[0] - origin[0]) / resolution - 0.5
            y = (ry + pose[1] - origin[1]) / resolution - 0.5
            j, i = int(np.floor(x)), int(np.floor(y))
            if i < 0 or j < 0 or i + 1 >= rows or j + 1 >= columns:
                squares += 0.25
                continue
            u, v = x - j, y - i
            l00, l01, l10, l11 = log_odds[i, j], log_odds[i, j + 1], log_odds[i + 1, j], log_odds[i + 1, j + 1]
            m00, m01, m10, m11 = _probability(l00), _probability(l01), _probability(l10), _probability(l11)
            below, above = (1.0 - u) * m00 + u * m01, (1.0 - u) * m10 + u * m11
            m = (1.0 - v) * below + v * above
            e = 1.0 - m
            squares += e * e
            if l00 != 0.0 or l01 != 0.0 or l10 != 0.0 or l11 != 0.0:
                known += 1
                if m > 0.5:
                    hit += 1
            gx = ((1.0 - v) * (m01 - m00) + v * (m11 - m10)) / resolution
            gy = (above - below) / resolution
            gt = gy * rx - gx * ry
            H[0, 0] += gx * gx
            H[0, 1] += gx * gy
            H[0, 2] += gx * gt
            H[1, 1] += gy * gy
            H[1, 2] += gy * gt
            H[2, 2] += gt * gt
            b[0] += gx * e
            b[1] += gy * e
            b[2] += gt * e
        H[1, 0], H[2, 0], H[2, 1] = H[0, 1], H[0, 2], H[1, 2]
        for k in range(3):
            H[k, k] += _REGULAR
        step = np.linalg.solve(H, b)
        step[2] = min(max(step[2], -_LARGEST_TURN), _LARGEST_TURN)
        pose += step
    pose[2] = np.arctan2(np.sin(pose[2]), np.cos(pose[2]))
    return pose, H, squares, hit, known


@njit(cache=True)
def _probability(log_odds: float) -> float:
    return 1.0 / (1.0 + math.exp(-log_odds))
