"""Rigid motions as twists (v, omega): Barfoot, "State Estimation for Robotics", 7.1; compiled, for use in loops."""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray

_SMALL = 1e-7


@njit(cache=True)
def skew(w: FloatArray) -> FloatArray:
    """(3, 3) matrix of the cross product with (3,) w."""
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


@njit(cache=True)
def product(A: FloatArray, B: FloatArray) -> FloatArray:
    """A B for small matrices, summed in the same order on every machine."""
    out = np.zeros((A.shape[0], B.shape[1]))
    for i in range(A.shape[0]):
        for j in range(B.shape[1]):
            for k in range(A.shape[1]):
                out[i, j] += A[i, k] * B[k, j]
    return out


@njit(cache=True)
def exp_so3(w: FloatArray) -> FloatArray:
    """(3, 3) rotation by |w| radians about (3,) w (Rodrigues)."""
    theta = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    K = skew(w)
    R: FloatArray = np.eye(3) + K
    if theta >= _SMALL:
        R = np.eye(3) + math.sin(theta) / theta * K + (1.0 - math.cos(theta)) / (theta * theta) * product(K, K)
    return R


@njit(cache=True)
def log_so3(R: FloatArray) -> FloatArray:
    """(3,) rotation vector of a (3, 3) rotation by less than half a turn."""
    w = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    if sine < _SMALL:
        return w
    return w * (math.atan2(sine, 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0)) / sine)


@njit(cache=True)
def exp_se3(xi: FloatArray) -> FloatArray:
    """(4, 4) motion of the (6,) twist: metres, then radians."""
    w = xi[3:]
    theta = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    K = skew(w)
    if theta < _SMALL:
        V = np.eye(3) + 0.5 * K
    else:
        V = (
            np.eye(3)
            + (1.0 - math.cos(theta)) / (theta * theta) * K
            + (theta - math.sin(theta)) / (theta * theta * theta) * product(K, K)
        )
    T = np.eye(4)
    T[:3, :3] = exp_so3(w)
    for i in range(3):
        T[i, 3] = V[i, 0] * xi[0] + V[i, 1] * xi[1] + V[i, 2] * xi[2]
    return T


@njit(cache=True)
def adjoint(T: FloatArray) -> FloatArray:
    """(6, 6) Ad with T exp(xi) = exp(Ad xi) T."""
    R = np.ascontiguousarray(T[:3, :3])
    A = np.zeros((6, 6))
    A[:3, :3] = R
    A[3:, 3:] = R
    A[:3, 3:] = product(skew(T[:3, 3]), R)
    return A
