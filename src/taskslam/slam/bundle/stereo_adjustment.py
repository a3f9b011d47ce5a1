"""Bundle adjustment of stereo keyframes and points, every point eliminated (Schur complement).

    [ U   W   ] [ xi ]   [ b ]      (U - W V^-1 W^T) xi = b - W V^-1 g,      dX = V^-1 (g - W^T xi)
    [ W^T V   ] [ dX ] = [ g ],

(Triggs et al. 2000, "Bundle adjustment: a modern synthesis", section 6.1); V is block-diagonal, 3 x 3 a point. Damped
as Levenberg and Marquardt do; a step that raises the cost is taken back. Huber's weights are optional.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.bundle.stereo_residuals import MONO, STEREO, huber, reproject, square
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.se3 import exp_se3, product

Ints = npt.NDArray[np.int64]
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-4, 1e-9, 1e3
_BEHIND = 100.0  # cost of a point behind a camera that saw it, in variances
_CONVERGED = 1e-4  # relative fall of the cost


class Sightings(NamedTuple):
    """O sightings sorted by point: those of point i are start[i]..start[i + 1].

    keyframes: (O,); seen: (O, 3) u, v and u in the right image or NaN; weights: (O,) inverse variances of a pixel, 0:
    not used. start: (N + 1,).
    """

    keyframes: Ints
    seen: FloatArray
    weights: FloatArray
    start: Ints


class Equations(NamedTuple):
    """Reduced: S (6 F, 6 F) and s over F free poses. V: (N, 3, 3) inverses, g: (N, 3), W: (O, 6, 3); cost."""

    S: FloatArray
    s: FloatArray
    V: FloatArray
    g: FloatArray
    W: FloatArray
    cost: float


@njit(cache=True)
def adjust(
    poses: FloatArray,
    free: int,
    places: FloatArray,
    sightings: Sightings,
    pinhole: Pinhole,
    iterations: int,
    robust: bool,
) -> tuple[FloatArray, FloatArray, float]:
    """(K, 4, 4) `T_camera_world`, (N, 3) places in the world and the cost after at most so many iterations.

    free: the first so many poses move, the others hold the gauge.
    """
    damping = _FIRST_DAMPING
    equations = reduced_equations(poses, free, places, sightings, pinhole, robust, damping)
    for _ in range(iterations):
        before = equations.cost
        step, solved = solve_cholesky(equations.S, equations.s)
        new_poses, new_places = poses.copy(), places.copy()
        after = np.inf
        if solved:
            for k in range(free):
                new_poses[k] = product(exp_se3(step[6 * k : 6 * k + 6]), poses[k])
            _move_points(new_places, free, sightings, equations, step)
            after = total_cost(new_poses, new_places, sightings, pinhole, robust)
        if after < before:
            poses, places = new_poses, new_places
            damping = max(0.1 * damping, _LEAST_DAMPING)
            if before - after < _CONVERGED * before:
                return poses, places, after
        else:
            damping *= 10.0
            if damping > _MOST_DAMPING:
                break
        equations = reduced_equations(poses, free, places, sightings, pinhole, robust, damping)
    return poses, places, equations.cost


@njit(cache=True)
def reduced_equations(
    poses: FloatArray,
    free: int,
    places: FloatArray,
    sightings: Sightings,
    pinhole: Pinhole,
    robust: bool,
    damping: float,
) -> Equations:
    """The equations of a step at these poses and places, every diagonal entry raised by `damping`, relative."""
    keyframes, seen, weights, start = sightings
    n = len(places)
    S, s = np.zeros((6 * free, 6 * free)), np.zeros(6 * free)
    V, g, W = np.zeros((n, 3, 3)), np.zeros((n, 3)), np.zeros((len(keyframes), 6, 3))
    r, J, P, L, A = np.zeros(3), np.zeros((3, 6)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((6, 3))
    cost = 0.0
    for i in range(n):
        for o in range(start[i], start[i + 1]):
            if weights[o] == 0.0:
                continue
            k = keyframes[o]
            rows = reproject(poses[k], places[i], seen[o], pinhole, r, J, P)
            if rows == 0:
                cost += _BEHIND
                continue
            chi, limit = square(r, rows, weights[o]), STEREO if rows == 3 else MONO
            w = weights[o]
            if robust:
                share = huber(chi, limit)
                w *= share
                chi = chi if share == 1.0 else 2.0 * math.sqrt(limit * chi) - limit
            cost += chi
            for q in range(rows):
                for h in range(3):
                    L[q, h] = P[q, 0] * poses[k, 0, h] + P[q, 1] * poses[k, 1, h] + P[q, 2] * poses[k, 2, h]
            for q in range(rows):
                for h in range(3):
                    g[i, h] += w * L[q, h] * r[q]
                    for m in range(3):
                        V[i, h, m] += w * L[q, h] * L[q, m]
            if k < free:
                for q in range(rows):
                    for h in range(6):
                        wj = w * J[q, h]
                        s[6 * k + h] += wj * r[q]
                        for m in range(h + 1):
                            S[6 * k + h, 6 * k + m] += wj * J[q, m]
                        for m in range(3):
                            W[o, h, m] += wj * L[q, m]
    for h in range(6 * free):
        S[h, h] += damping * S[h, h] + 1e-9
    for i in range(n):
        _invert(V[i], damping)
        for o in range(start[i], start[i + 1]):
            k = keyframes[o]
            if k >= free or weights[o] == 0.0:
                continue
            for h in range(6):
                for m in range(3):
                    A[h, m] = W[o, h, 0] * V[i, 0, m] + W[o, h, 1] * V[i, 1, m] + W[o, h, 2] * V[i, 2, m]
                s[6 * k + h] -= A[h, 0] * g[i, 0] + A[h, 1] * g[i, 1] + A[h, 2] * g[i, 2]
            for other in range(start[i], start[i + 1]):
                k2 = keyframes[other]
                if k2 > k or weights[other] == 0.0:
                    continue
                for h in range(6):
                    for m in range(6):
                        S[6 * k + h, 6 * k2 + m] -= (
                            A[h, 0] * W[other, m, 0] + A[h, 1] * W[other, m, 1] + A[h, 2] * W[other, m, 2]
                        )
    for h in range(6 * free):
        for m in range(h):
            S[m, h] = S[h, m]
    return Equations(S, s, V, g, W, cost)


@njit(cache=True)
def total_cost(poses: FloatArray, places: FloatArray, sightings: Sightings, pinhole: Pinhole, robust: bool) -> float:
    """Sum of squared errors in variances, Huber's where robust."""
    keyframes, seen, weights, start = sightings
    r, J, P = np.zeros(3), np.zeros((3, 6)), np.zeros((3, 3))
    cost = 0.0
    for i in range(len(places)):
        for o in range(start[i], start[i + 1]):
            if weights[o] == 0.0:
                continue
            rows = reproject(poses[keyframes[o]], places[i], seen[o], pinhole, r, J, P)
            if rows == 0:
                cost += _BEHIND
                continue
            chi, limit = square(r, rows, weights[o]), STEREO if rows == 3 else MONO
            cost += chi if not robust or chi <= limit else 2.0 * math.sqrt(limit * chi) - limit
    return cost


@njit(cache=True)
def squared_errors(poses: FloatArray, places: FloatArray, sightings: Sightings, pinhole: Pinhole) -> FloatArray:
    """(O,) squared errors in variances over the limit of their degrees of freedom: above 1 are outliers."""
    keyframes, seen, weights, start = sightings
    r, J, P = np.zeros(3), np.zeros((3, 6)), np.zeros((3, 3))
    errors = np.full(len(keyframes), np.inf)
    for i in range(len(places)):
        for o in range(start[i], start[i + 1]):
            rows = reproject(poses[keyframes[o]], places[i], seen[o], pinhole, r, J, P)
            if rows > 0:
                errors[o] = square(r, rows, weights[o]) / (STEREO if rows == 3 else MONO)
    return errors


@njit(cache=True)
def _move_points(places: FloatArray, free: int, sightings: Sightings, equations: Equations, step: FloatArray) -> None:
    d = np.zeros(3)
    for i in range(len(places)):
        d[:] = equations.g[i]
        for o in range(sightings.start[i], sightings.start[i + 1]):
            k = sightings.keyframes[o]
            if k < free and sightings.weights[o] != 0.0:
                for h in range(6):
                    for m in range(3):
                        d[m] -= equations.W[o, h, m] * step[6 * k + h]
        V = equations.V[i]
        for h in range(3):
            places[i, h] += V[h, 0] * d[0] + V[h, 1] * d[1] + V[h, 2] * d[2]


@njit(cache=True)
def _invert(A: FloatArray, damping: float) -> None:
    """In place, the inverse of a symmetric (3, 3) matrix with its diagonal raised; zero where nothing was seen."""
    for h in range(3):
        A[h, h] += damping * A[h, h] + 1e-9
    c00 = A[1, 1] * A[2, 2] - A[1, 2] * A[2, 1]
    c01 = A[0, 2] * A[2, 1] - A[0, 1] * A[2, 2]
    c02 = A[0, 1] * A[1, 2] - A[0, 2] * A[1, 1]
    c11 = A[0, 0] * A[2, 2] - A[0, 2] * A[2, 0]
    c12 = A[0, 2] * A[1, 0] - A[0, 0] * A[1, 2]
    c22 = A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
    determinant = A[0, 0] * c00 + A[1, 0] * c01 + A[2, 0] * c02
    scale = 1.0 / determinant if determinant > 1e-24 else 0.0
    A[0, 0], A[0, 1], A[0, 2] = c00 * scale, c01 * scale, c02 * scale
    A[1, 0], A[1, 1], A[1, 2] = c01 * scale, c11 * scale, c12 * scale
    A[2, 0], A[2, 1], A[2, 2] = c02 * scale, c12 * scale, c22 * scale


@njit(cache=True, fastmath={"reassoc", "contract"})
def factor_cholesky(A: FloatArray) -> tuple[FloatArray, bool]:
    """Lower (N, N) L with L L^T = A, row by row; False where A is not positive definite."""
    n = len(A)
    L = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if i == j:
                if not total > 0.0:
                    return L, False
                L[i, i] = math.sqrt(total)
            else:
                L[i, j] = total / L[j, j]
    return L, True


@njit(cache=True)
def solve_cholesky(A: FloatArray, b: FloatArray) -> tuple[FloatArray, bool]:
    """(N,) x of A x = b; False where A is not positive definite."""
    L, positive = factor_cholesky(A)
    x = b.copy()
    if not positive:
        return x, False
    n = len(b)
    for i in range(n):
        for k in range(i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
    for i in range(n - 1, -1, -1):
        x[i] /= L[i, i]
        for k in range(i):
            x[k] -= L[i, k] * x[i]
    return x, True
