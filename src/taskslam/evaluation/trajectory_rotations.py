"""Rotations as unit quaternions x y z w, many at a time: angles between them, and their mean."""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray


def rotation_angles(a: FloatArray, b: FloatArray) -> FloatArray:
    """(N,) angles in [0, pi] between (N, 4) unit quaternions: 2 atan2(|v|, |w|) of a^-1 b, also for tiny ones."""
    angles = np.empty(len(a))
    _angles(np.ascontiguousarray(a), np.ascontiguousarray(b), angles)
    return angles


def mean_rotations(quaternions: FloatArray) -> FloatArray:
    """(F, 4) mean of each of (F, R, 4) sets of unit quaternions: main eigenvector of sum q q^T (protocol 5.8).

    It minimises the sum of squared chordal distances (Markley et al., 2007), q and -q alike.
    """
    outer = np.einsum("fri,frj->fij", quaternions, quaternions)
    mean: FloatArray = np.linalg.eigh(outer)[1][:, :, -1]
    return mean


@njit(cache=True)
def between(a: FloatArray, b: FloatArray) -> tuple[float, float, float, float]:
    """a^-1 b of two quaternions x y z w."""
    return (
        a[3] * b[0] - a[0] * b[3] - a[1] * b[2] + a[2] * b[1],
        a[3] * b[1] + a[0] * b[2] - a[1] * b[3] - a[2] * b[0],
        a[3] * b[2] - a[0] * b[1] + a[1] * b[0] - a[2] * b[3],
        a[3] * b[3] + a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
    )


@njit(cache=True)
def angle(q: tuple[float, float, float, float]) -> float:
    """Of a unit quaternion, in [0, pi]."""
    return 2.0 * math.atan2(math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]), abs(q[3]))


@njit(cache=True)
def _angles(a: FloatArray, b: FloatArray, angles: FloatArray) -> None:
    for row in range(len(angles)):
        angles[row] = angle(between(a[row], b[row]))
