"""SO(3): exponential, logarithm and right Jacobians.

Forster, Carlone, Dellaert, Scaramuzza, "On-manifold preintegration", T-RO 2017, eqs. (3) to (9). Below `_SMALL` radians
the first terms of the series stand for the quotients; what they leave out is below 1e-13.
"""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray

_SMALL = 1e-3
_NEAR_PI = 1e-6  # of 1 + cos(angle): from there on the axis is read from the symmetric part


@njit(cache=True)
def hat(v: FloatArray) -> FloatArray:
    """The matrix of the cross product, (3, 3): it takes w to v x w."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


@njit(cache=True)
def rotate(R: FloatArray, x: float, y: float, z: float) -> tuple[float, float, float]:
    """R times (x, y, z), for loops over points: without arrays, and without the call that `@` makes."""
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@njit(cache=True)
def quotients(angle: float) -> tuple[float, float, float]:
    """Of the angle t: sin t / t, (1 - cos t) / t^2 and (t - sin t) / t^3."""
    square = angle * angle
    if angle < _SMALL:
        return 1.0 - square / 6.0, 0.5 - square / 24.0, (1.0 - square / 20.0) / 6.0
    sine = math.sin(angle)
    half = math.sin(0.5 * angle)
    return sine / angle, 2.0 * half * half / square, (angle - sine) / (square * angle)


@njit(cache=True)
def exp_so3(v: FloatArray) -> FloatArray:
    """(3, 3) rotation by |v| radians about v: Rodrigues' formula."""
    first, second, _ = quotients(math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))
    x, y, z = v[0], v[1], v[2]
    return np.array(
        [
            [1.0 - second * (y * y + z * z), second * x * y - first * z, second * x * z + first * y],
            [second * x * y + first * z, 1.0 - second * (x * x + z * z), second * y * z - first * x],
            [second * x * z - first * y, second * y * z + first * x, 1.0 - second * (x * x + y * y)],
        ]
    )


@njit(cache=True)
def log_so3(R: FloatArray) -> FloatArray:
    """(3,) rotation vector of R, its length in [0, pi]."""
    twice = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = 0.5 * math.sqrt(twice[0] ** 2 + twice[1] ** 2 + twice[2] ** 2)
    cosine = 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0)
    angle = math.atan2(sine, cosine)
    if 1.0 + cosine > _NEAR_PI:
        v: FloatArray = twice * (0.5 / quotients(angle)[0])
        return v
    symmetric = 0.5 * (R + R.T)
    for k in range(3):
        symmetric[k, k] -= cosine  # now (1 - cos t) a a^T
    largest = 0
    for k in range(1, 3):
        if symmetric[k, k] > symmetric[largest, largest]:
            largest = k
    axis: FloatArray = symmetric[largest].copy()
    axis /= math.sqrt(axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2)
    turned_back = axis[0] * twice[0] + axis[1] * twice[1] + axis[2] * twice[2] < 0.0
    return axis * (-angle if turned_back else angle)


@njit(cache=True)
def right_jacobian(v: FloatArray) -> FloatArray:
    """(3, 3) J with exp(v + d) = exp(v) exp(J d) to first order in d."""
    _, second, third = quotients(math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))
    V = hat(v)
    J: FloatArray = np.eye(3) - second * V + third * (V @ V)
    return J


@njit(cache=True)
def inverse_right_jacobian(v: FloatArray) -> FloatArray:
    """(3, 3) J^-1 with log(exp(v) exp(d)) = v + J^-1 d to first order in d; |v| < 2 pi."""
    angle = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    if angle < _SMALL:
        quotient = (1.0 + angle * angle / 60.0) / 12.0
    else:
        half = 0.5 * angle
        quotient = (1.0 - half * math.cos(half) / math.sin(half)) / (angle * angle)
    V = hat(v)
    J: FloatArray = np.eye(3) + 0.5 * V + quotient * (V @ V)
    return J
