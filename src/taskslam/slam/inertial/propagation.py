"""A state carried over one IMU sample, and how errors in it are carried along.

While a sample holds, the body turns at a constant rate and feels a constant specific force; both are integrated in
closed form (Forster et al., T-RO 2017, eqs. (26) to (31), without their step of first order). The error of a state is
(15,) in the order of the offsets below: rotation in the body frame, R = R_estimated exp(error), and differences.
"""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.inertial.rotations import exp_so3, hat, right_jacobian

ROTATION, POSITION, VELOCITY, GYRO_BIAS, ACCEL_BIAS = 0, 3, 6, 9, 12
SIZE = 15
_SMALL = 0.1  # radians: below, three terms of the series are exact to 1e-12, and the quotients cancel


@njit(cache=True)
def _mean_rotations(turn: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of exp(s turn), s from 0 to 1: its integral, and the integral of that; (3, 3) each."""
    angle = math.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2)
    square = angle * angle
    if angle < _SMALL:
        third = (1.0 - square / 20.0 * (1.0 - square / 42.0)) / 6.0
        fourth = (1.0 - square / 30.0 * (1.0 - square / 56.0)) / 24.0
    else:
        third = (angle - math.sin(angle)) / (square * angle)
        fourth = (0.5 * square + math.cos(angle) - 1.0) / (square * square)
    V = hat(turn)
    return right_jacobian(-turn), 0.5 * np.eye(3) + third * V + fourth * (V @ V)


@njit(cache=True)
def move(  # type: ignore[no-untyped-def]
    R: FloatArray, p: FloatArray, v: FloatArray, rate: FloatArray, force: FloatArray, g: FloatArray, dt: float
):
    """Pose and velocity after dt seconds; returns (R, p, v).

    R, p: (3, 3), (3,) pose of the IMU in the world; v: (3,) its velocity there, m/s. rate: (3,) rad/s and force: (3,)
    m/s^2 in the IMU frame, without their biases. g: (3,) gravity in the world, m/s^2, pointing down.
    """
    once, twice = _mean_rotations(rate * dt)
    return (
        R @ exp_so3(rate * dt),
        p + v * dt + (R @ (twice @ force) + 0.5 * g) * (dt * dt),
        v + (R @ (once @ force) + g) * dt,
    )


@njit(cache=True)
def transition(R: FloatArray, rate: FloatArray, force: FloatArray, dt: float) -> FloatArray:
    """(15, 15) derivative of the error after `move` by the error before it.

    What the gyro's bias does to velocity and position within one sample, of the order of dt^2, is left out.
    """
    once, twice = _mean_rotations(rate * dt)
    F = np.eye(SIZE)
    F[0:3, 0:3] = exp_so3(-rate * dt)
    F[0:3, 9:12] = -dt * right_jacobian(rate * dt)
    F[3:6, 0:3] = -(dt * dt) * (R @ hat(twice @ force))
    F[3:6, 6:9] = dt * np.eye(3)
    F[3:6, 12:15] = -(dt * dt) * (R @ twice)
    F[6:9, 0:3] = -dt * (R @ hat(once @ force))
    F[6:9, 12:15] = -dt * (R @ once)
    return F
