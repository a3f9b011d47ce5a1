"""Two-point RANSAC: with the rotation known, two of the features give the direction of the translation.

Troiani, Martinelli, Laugier, Scaramuzza, "2-point-based outlier rejection for camera-IMU systems", ICRA 2014.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray

_PARALLEL = 1e-12


@njit(cache=True)
def one_translation(
    before: FloatArray, now: FloatArray, draws: npt.NDArray[np.int64], threshold: float
) -> npt.NDArray[np.bool_]:
    """(N,) which features lie within the threshold of the epipolar lines of the translation that most agree with.

    before, now: (N, 2) normalised coordinates, the former turned as the camera turned. draws: (K, 2) features to try.
    A translation t has t . (a x b) = 0 for each pair of rays a, b; two of these normals give it.
    """
    count = len(before)
    normals = np.empty((count, 3))
    for k in range(count):
        ax, ay, bx, by = before[k, 0], before[k, 1], now[k, 0], now[k, 1]
        normals[k, 0], normals[k, 1], normals[k, 2] = ay - by, bx - ax, ax * by - ay * bx
    best, most = np.zeros(count, np.bool_), 0
    agree = np.empty(count, np.bool_)
    for i, j in draws:
        m, n = normals[i], normals[j]
        x, y, z = m[1] * n[2] - m[2] * n[1], m[2] * n[0] - m[0] * n[2], m[0] * n[1] - m[1] * n[0]
        length = math.sqrt(x * x + y * y + z * z)
        if length < _PARALLEL:
            continue
        x, y, z = x / length, y / length, z / length
        agreeing = 0
        for k in range(count):
            ax, ay = before[k, 0], before[k, 1]
            lx, ly, lz = y - z * ay, z * ax - x, x * ay - y * ax  # the line: t x a
            off = abs(lx * now[k, 0] + ly * now[k, 1] + lz)
            agree[k] = off < threshold * max(math.sqrt(lx * lx + ly * ly), 1e-9)
            agreeing += agree[k]
        if agreeing > most:
            best, most = agree.copy(), agreeing
    return best
