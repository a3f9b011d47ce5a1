"""How a point is seen by a stereo pair, and how that changes: three rows u, v and u in the right image.

With p = T_camera_world X and T <- exp(xi) T, xi = (v, omega) as in `vision/se3.py`, dp/dxi = [I, -[p]x] and
dp/dX = R; a point that only the left camera saw has no third row (Mur-Artal and Tardos 2017, section III.B).
"""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.pinhole import Pinhole

NEAREST = 0.05  # m: of a point before the camera
MONO, STEREO = 5.991, 7.815  # squared, chi-square quantiles at 95 % of two and three degrees of freedom


@njit(cache=True)
def reproject(
    T: FloatArray, X: FloatArray, seen: FloatArray, pinhole: Pinhole, r: FloatArray, J: FloatArray, P: FloatArray
) -> int:
    """Rows that count (0: behind the camera, 2 or 3). Fills r = seen - predicted, (3,); J = d predicted / dxi, (3, 6).

    T: (4, 4) `T_camera_world`; X: (3,); seen: (3,) u, v, u in the right image or NaN. P: (3, 3), d predicted / dp.
    """
    x = T[0, 0] * X[0] + T[0, 1] * X[1] + T[0, 2] * X[2] + T[0, 3]
    y = T[1, 0] * X[0] + T[1, 1] * X[1] + T[1, 2] * X[2] + T[1, 3]
    z = T[2, 0] * X[0] + T[2, 1] * X[1] + T[2, 2] * X[2] + T[2, 3]
    if not z > NEAREST:
        return 0
    inverse = 1.0 / z
    a = pinhole.f * inverse
    u = a * x + pinhole.cx
    r[0] = seen[0] - u
    r[1] = seen[1] - (a * y + pinhole.cy)
    P[0, 0], P[0, 1], P[0, 2] = a, 0.0, -a * x * inverse
    P[1, 0], P[1, 1], P[1, 2] = 0.0, a, -a * y * inverse
    rows = 2
    if not np.isnan(seen[2]):
        rows = 3
        r[2] = seen[2] - (u - a * pinhole.baseline)
        P[2, 0], P[2, 1], P[2, 2] = a, 0.0, (pinhole.baseline - x) * a * inverse
    for i in range(rows):
        J[i, 0], J[i, 1], J[i, 2] = P[i, 0], P[i, 1], P[i, 2]
        J[i, 3] = P[i, 2] * y - P[i, 1] * z
        J[i, 4] = P[i, 0] * z - P[i, 2] * x
        J[i, 5] = P[i, 1] * x - P[i, 0] * y
    return rows


@njit(cache=True)
def square(r: FloatArray, rows: int, weight: float) -> float:
    """Squared error of the first rows, in units of its variance 1 / weight."""
    total = float(r[0] * r[0] + r[1] * r[1])
    if rows == 3:
        total += float(r[2] * r[2])
    return total * weight


@njit(cache=True)
def huber(chi: float, limit: float) -> float:
    """Weight of a squared error beyond `limit`, squared too (Huber 1964)."""
    return 1.0 if chi <= limit else math.sqrt(limit / chi)
