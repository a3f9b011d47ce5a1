"""The pose of a stereo camera from matches of which many are wrong: three points at a time, drawn at random.

Three points, seen with their depths and known in the world, give the pose in closed form (Horn 1987, section 2: an
orthogonal triad is built of three points on either side); the pose that most matches fit wins (Fischler and Bolles
1981).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.bundle.stereo_pose import fits_pose
from taskslam.slam.vision.pinhole import Pinhole

_MULTIPLIER, _MODULUS = 48271, 2147483647  # Park and Miller 1988
_FLAT = 1e-6  # m^2: of three points whose triangle is smaller nothing follows


@njit(cache=True)
def draw_pose(
    places: FloatArray, seen: FloatArray, weights: FloatArray, pinhole: Pinhole, draws: int, seed: int
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """(4, 4) `T_camera_world` and (N,) which of the matches fit it; the unit matrix, and none, where no three do.

    places: (N, 3) in the world; seen: (N, 3) u, v, and u in the right image or NaN; weights: (N,) inverse variances.
    """
    n = len(places)
    near = np.flatnonzero(~np.isnan(seen[:, 2]))
    best, best_fits = np.eye(4), np.zeros(n, np.bool_)
    if len(near) < 3:
        return best, best_fits
    state = seed % (_MODULUS - 1) + 1
    picked = np.empty(3, np.int64)
    world, camera = np.empty((3, 3)), np.empty((3, 3))
    most = 0
    for _ in range(draws):
        for k in range(3):
            state = state * _MULTIPLIER % _MODULUS
            picked[k] = near[state % len(near)]
        for k in range(3):
            i = picked[k]
            z = pinhole.f * pinhole.baseline / (seen[i, 0] - seen[i, 2])
            camera[k, 0] = (seen[i, 0] - pinhole.cx) / pinhole.f * z
            camera[k, 1] = (seen[i, 1] - pinhole.cy) / pinhole.f * z
            camera[k, 2] = z
            world[k] = places[i]
        T, solved = align_triads(world, camera)
        if not solved:
            continue
        fits = fits_pose(T, places, seen, weights, pinhole)
        if fits.sum() > most:
            most, best, best_fits = fits.sum(), T, fits
    return best, best_fits


@njit(cache=True)
def align_triads(world: FloatArray, camera: FloatArray) -> tuple[FloatArray, bool]:
    """(4, 4) `T_camera_world` that lays (3, 3) points of the world, one a row, on those of the camera."""
    A, flat_a = _triad(world)
    B, flat_b = _triad(camera)
    T = np.eye(4)
    if flat_a or flat_b:
        return T, False
    for i in range(3):
        for j in range(3):
            T[i, j] = B[0, i] * A[0, j] + B[1, i] * A[1, j] + B[2, i] * A[2, j]
    for i in range(3):
        T[i, 3] = (camera[0, i] + camera[1, i] + camera[2, i]) / 3.0
        for j in range(3):
            T[i, 3] -= T[i, j] * (world[0, j] + world[1, j] + world[2, j]) / 3.0
    return T, True


@njit(cache=True)
def _triad(points: FloatArray) -> tuple[FloatArray, bool]:
    """(3, 3) orthonormal rows: along the first side, in the plane, and across it."""
    out = np.zeros((3, 3))
    a, b = points[1] - points[0], points[2] - points[0]
    normal = np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
    size = math.sqrt(np.sum(normal * normal))
    if not size > _FLAT:
        return out, True
    out[0] = a / math.sqrt(np.sum(a * a))
    out[2] = normal / size
    x, z = out[0], out[2]
    out[1, 0] = z[1] * x[2] - z[2] * x[1]
    out[1, 1] = z[2] * x[0] - z[0] * x[2]
    out[1, 2] = z[0] * x[1] - z[1] * x[0]
    return out, False
