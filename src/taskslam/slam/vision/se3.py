"""Rigid motions as twists (v, omega): Barfoot, "State Estimation for Robotics", 7.1; compiled, for use in loops."""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.inertial.rotations import exp_so3, hat, quotients


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
def exp_se3(xi: FloatArray) -> FloatArray:
    """(4, 4) motion of the (6,) twist: metres, then radians."""
    w = xi[3:]
    _, second, third = quotients(math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]))
    K = hat(w)
    V = np.eye(3) + second * K + third * product(K, K)
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
    A[:3, 3:] = product(hat(T[:3, 3]), R)
    return A
