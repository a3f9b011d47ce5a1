"""The state of the filter, its manifold, and how the IMU carries it along.

An error is (23,): the 15 of `inertial/propagation.py`, then rotation and translation of the LiDAR in the IMU, then two
of gravity on its sphere (Sec. IV-A of the paper; the sphere as in He, Xu, Zhang, "Kalman filters on differentiable
manifolds", 2021).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.inertial.propagation import move, transition
from taskslam.slam.inertial.rotations import exp_so3, hat, inverse_right_jacobian, log_so3

EXTRINSIC_ROTATION, EXTRINSIC_TRANSLATION, GRAVITY = 15, 18, 21
DIMENSIONS = 23


class State(NamedTuple):
    """R, p: (3, 3), (3,) pose of the IMU in the world, where it stood at the start; v: its velocity there.

    b_g, b_a: biases of gyro and accelerometer. R_il, p_il: pose of the LiDAR in the IMU. g: gravity in the world.
    """

    R: FloatArray
    p: FloatArray
    v: FloatArray
    b_g: FloatArray
    b_a: FloatArray
    R_il: FloatArray
    p_il: FloatArray
    g: FloatArray


class Track(NamedTuple):
    """Where the IMU was within a scan: pieces that begin at (K,) times, seconds before the scan's end.

    R: (K, 3, 3), p, v: (K, 3) at their beginnings; rates: (K, 3) in the IMU, and accelerations: (K, 3) in the world,
    hold for the piece.
    """

    times: FloatArray
    R: FloatArray
    p: FloatArray
    v: FloatArray
    rates: FloatArray
    accelerations: FloatArray


@njit(cache=True)
def tangent_of_gravity(g: FloatArray) -> FloatArray:
    """(3, 2) orthonormal directions across g."""
    length = math.sqrt(g[0] ** 2 + g[1] ** 2 + g[2] ** 2)
    x, y, z = g[0] / length, g[1] / length, g[2] / length
    if z < 0.0:  # continued from the pole that gravity is near
        s = 1.0 - z
        return np.array([[1.0 - x * x / s, -x * y / s], [-x * y / s, 1.0 - y * y / s], [x, y]])
    s = 1.0 + z
    return np.array([[1.0 - x * x / s, -x * y / s], [-x * y / s, 1.0 - y * y / s], [-x, -y]])


@njit(cache=True)
def _between(g: FloatArray, origin: FloatArray) -> tuple[FloatArray, float, float]:
    """The rotation vector from origin to g divided by its sine, that sine, and the cosine."""
    square = origin[0] ** 2 + origin[1] ** 2 + origin[2] ** 2
    across = (hat(origin) @ g) / square
    sine = math.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
    cosine = (origin[0] * g[0] + origin[1] * g[1] + origin[2] * g[2]) / square
    return across, sine, cosine


@njit(cache=True)
def plus(x: State, d: FloatArray) -> State:
    """The state that differs from x by the (23,) error d."""
    return State(
        x.R @ exp_so3(d[0:3]),
        x.p + d[3:6],
        x.v + d[6:9],
        x.b_g + d[9:12],
        x.b_a + d[12:15],
        x.R_il @ exp_so3(d[15:18]),
        x.p_il + d[18:21],
        exp_so3(tangent_of_gravity(x.g) @ np.ascontiguousarray(d[21:23])) @ x.g,
    )


@njit(cache=True)
def minus(x: State, origin: State) -> FloatArray:
    """(23,) error d with plus(origin, d) = x."""
    d = np.empty(DIMENSIONS)
    d[0:3] = log_so3(origin.R.T @ x.R)
    d[3:6] = x.p - origin.p
    d[6:9] = x.v - origin.v
    d[9:12] = x.b_g - origin.b_g
    d[12:15] = x.b_a - origin.b_a
    d[15:18] = log_so3(origin.R_il.T @ x.R_il)
    d[18:21] = x.p_il - origin.p_il
    across, sine, cosine = _between(x.g, origin.g)
    stretch = math.atan2(sine, cosine) / sine if sine > 1e-9 else 1.0
    d[21:23] = tangent_of_gravity(origin.g).T @ (across * stretch)
    return d


@njit(cache=True)
def minus_jacobian(x: State, origin: State) -> FloatArray:
    """(23, 23) derivative of minus(plus(x, d), origin) by d at d = 0: the J of the paper's eq. (13)."""
    J = np.eye(DIMENSIONS)
    J[0:3, 0:3] = inverse_right_jacobian(log_so3(origin.R.T @ x.R))
    J[15:18, 15:18] = inverse_right_jacobian(log_so3(origin.R_il.T @ x.R_il))
    across, sine, cosine = _between(x.g, origin.g)
    square = origin.g[0] ** 2 + origin.g[1] ** 2 + origin.g[2] ** 2
    by_g = hat(origin.g) / square
    if sine > 1e-6:
        angle = math.atan2(sine, cosine)
        by_g = by_g * (angle / sine)
        for a in range(3):
            for b in range(3):
                d_sine = 0.0
                for c in range(3):
                    d_sine += across[c] / sine * hat(origin.g)[c, b] / square
                d_angle = cosine * d_sine - sine * origin.g[b] / square
                by_g[a, b] += across[a] * (d_angle / sine - angle * d_sine / (sine * sine))
    J[21:23, 21:23] = tangent_of_gravity(origin.g).T @ by_g @ (-hat(x.g) @ tangent_of_gravity(x.g))
    return J


@njit(cache=True)
def carried(  # type: ignore[no-untyped-def]
    x: State, P: FloatArray, durations: FloatArray, rates: FloatArray, forces: FloatArray, variances: FloatArray
):
    """State, covariance and `Track` after (K,) pieces of so many seconds, under (K, 3) rates and forces of the IMU.

    variances: (K, 4) what a piece adds to those of rotation, velocity, gyro bias and accelerometer bias. The last piece
    ends with the scan. A piece whose readings are not finite has none: the robot goes on as it went.
    """
    count = len(durations)
    times, at_R, at_p, at_v = np.empty(count), np.empty((count, 3, 3)), np.empty((count, 3)), np.empty((count, 3))
    turning, accelerations = np.empty((count, 3)), np.empty((count, 3))
    to_end = -np.sum(durations)
    for k in range(count):
        dt = durations[k]
        known = np.isfinite(rates[k, 0])
        rate = rates[k] - x.b_g if known else np.zeros(3)
        force = forces[k] - x.b_a if known else -(x.R.T @ x.g)
        times[k], at_R[k], at_p[k], at_v[k], turning[k] = to_end, x.R, x.p, x.v, rate
        F = np.eye(DIMENSIONS)
        F[:15, :15] = transition(x.R, rate, force, dt)
        by_gravity = -hat(x.g) @ tangent_of_gravity(x.g)
        F[3:6, 21:23] = 0.5 * dt * dt * by_gravity
        F[6:9, 21:23] = dt * by_gravity
        R, p, v = move(x.R, x.p, x.v, rate, force, x.g, dt)
        accelerations[k] = (v - x.v) / dt
        P = F @ P @ F.T
        for axis in range(3):
            P[axis, axis] += variances[k, 0]
            P[6 + axis, 6 + axis] += variances[k, 1]
            P[9 + axis, 9 + axis] += variances[k, 2]
            P[12 + axis, 12 + axis] += variances[k, 3]
        x = State(R, p, v, x.b_g, x.b_a, x.R_il, x.p_il, x.g)
        to_end += dt
    return x, P, Track(times, at_R, at_p, at_v, turning, accelerations)
