"""The pose of a stereo camera from points whose places are known: motion-only bundle adjustment.

Mur-Artal and Tardos 2017, section III.C, as its release runs it: four rounds of at most ten steps, Huber's weights in
the first two; after each round what fits no better than one in twenty of true matches is left out of the next.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.bundle.stereo_residuals import MONO, STEREO, huber, reproject, square
from taskslam.slam.vision.cholesky import solve_positive
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.se3 import exp_se3, product

_ROUNDS, _STEPS = 4, 10
_SMALLEST_STEP = 1e-6
_LEAST = 6  # fits, of which a pose may come


@njit(cache=True)
def solve_stereo_pose(
    T_camera_world: FloatArray, places: FloatArray, seen: FloatArray, weights: FloatArray, pinhole: Pinhole
) -> tuple[FloatArray, npt.NDArray[np.bool_], FloatArray]:
    """(4, 4) `T_camera_world`, (N,) which points fit it, and its (6, 6) information.

    places: (N, 3) in the world; seen: (N, 3) u, v, and u in the right image or NaN; weights: (N,) inverse variances of
    a pixel. Where the points do not determine a pose nothing fits.
    """
    T, n = T_camera_world.copy(), len(places)
    fits = np.ones(n, np.bool_)
    r, J, P = np.zeros(3), np.zeros((3, 6)), np.zeros((3, 3))
    H = np.zeros((6, 6))
    for turn in range(_ROUNDS):
        robust = turn < 2
        for _ in range(_STEPS):
            H[:], b, used = 0.0, np.zeros(6), 0
            for i in range(n):
                if not fits[i]:
                    continue
                rows = reproject(T, places[i], seen[i], pinhole, r, J, P)
                if rows == 0:
                    continue
                used += 1
                w = weights[i]
                if robust:
                    w *= huber(square(r, rows, weights[i]), STEREO if rows == 3 else MONO)
                for k in range(rows):
                    for p in range(6):
                        b[p] += w * J[k, p] * r[k]
                        for q in range(p + 1):
                            H[p, q] += w * J[k, p] * J[k, q]
            for p in range(6):
                for q in range(p):
                    H[q, p] = H[p, q]
            step, solved = solve_positive(H, b)
            if used < _LEAST or not solved:
                return T, np.zeros(n, np.bool_), H
            T = product(exp_se3(step), T)
            if np.sqrt(np.sum(step * step)) < _SMALLEST_STEP:
                break
        for i in range(n):
            rows = reproject(T, places[i], seen[i], pinhole, r, J, P)
            fits[i] = rows > 0 and square(r, rows, weights[i]) <= (STEREO if rows == 3 else MONO)
    return T, fits, H


@njit(cache=True)
def fits_pose(
    T_camera_world: FloatArray, places: FloatArray, seen: FloatArray, weights: FloatArray, pinhole: Pinhole
) -> npt.NDArray[np.bool_]:
    """(N,) which points, as in `solve_stereo_pose`, fit a pose as well as 19 of 20 true matches do."""
    r, J, P = np.zeros(3), np.zeros((3, 6)), np.zeros((3, 3))
    fits = np.zeros(len(places), np.bool_)
    for i in range(len(places)):
        rows = reproject(T_camera_world, places[i], seen[i], pinhole, r, J, P)
        fits[i] = rows > 0 and square(r, rows, weights[i]) <= (STEREO if rows == 3 else MONO)
    return fits
