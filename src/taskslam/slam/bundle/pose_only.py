"""The pose of a camera from points whose places are known: Gauss-Newton on reprojection errors, Tukey's weights.

Forster et al. 2017, section IV.C: motion-only bundle adjustment. The scale is 1.48 times the median of the first errors
(MAD), at least half a pixel; beyond 4.685 of it an error counts nothing (Tukey's biweight).
"""

from __future__ import annotations

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.cholesky import solve_positive
from taskslam.slam.vision.direct_alignment import twist_jacobian
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.se3 import exp_se3, product

_LEAST_SCALE = 0.5  # pixels
_TUKEY = 4.685
_SMALLEST_STEP = 1e-7


@njit(cache=True)
def refine_pose(
    T_camera_world: FloatArray,
    points: FloatArray,
    pixels: FloatArray,
    normals: FloatArray,
    weights: FloatArray,
    pinhole: Pinhole,
    iterations: int,
    robust: bool = True,
) -> tuple[FloatArray, FloatArray, bool]:
    """(4, 4) `T_camera_world`, (N,) errors in pixels after it, and whether the points determine it.

    points: (N, 3) in the world; pixels: (N, 2) where they are seen; normals: (N, 2) directions along which alone an
    error counts, or zeros: any. weights: (N,) of the errors. robust: whether to use Tukey's weights.
    """
    f, cx, cy = pinhole.f, pinhole.cx, pinhole.cy
    T = T_camera_world.copy()
    count = len(points)
    J0, J1, J = np.zeros(6), np.zeros(6), np.zeros(6)
    errors = np.full(count, np.inf)
    scale = np.inf
    for iteration in range(iterations + 1):
        H, b = np.zeros((6, 6)), np.zeros(6)
        for n in range(count):
            X = T[0, 0] * points[n, 0] + T[0, 1] * points[n, 1] + T[0, 2] * points[n, 2] + T[0, 3]
            Y = T[1, 0] * points[n, 0] + T[1, 1] * points[n, 1] + T[1, 2] * points[n, 2] + T[1, 3]
            Z = T[2, 0] * points[n, 0] + T[2, 1] * points[n, 1] + T[2, 2] * points[n, 2] + T[2, 3]
            errors[n] = np.inf
            if Z < 1e-3:
                continue
            x, y = X / Z, Y / Z
            ru, rv = f * x + cx - pixels[n, 0], f * y + cy - pixels[n, 1]
            edge = normals[n, 0] != 0.0 or normals[n, 1] != 0.0
            along = normals[n, 0] * ru + normals[n, 1] * rv
            errors[n] = abs(along) if edge else np.sqrt(ru * ru + rv * rv)
            w = weights[n]
            if robust and iteration > 0:
                ratio = errors[n] / (_TUKEY * scale)
                w *= (1.0 - ratio * ratio) ** 2 if ratio < 1.0 else 0.0
            twist_jacobian(J0, J1, f, x, y, 1.0 / Z, x)
            if edge:
                for i in range(6):
                    J[i] = normals[n, 0] * J0[i] + normals[n, 1] * J1[i]
            for i in range(6):
                b[i] -= w * (J[i] * along if edge else J0[i] * ru + J1[i] * rv)
                for j in range(6):
                    H[i, j] += w * (J[i] * J[j] if edge else J0[i] * J0[j] + J1[i] * J1[j])
        if iteration == iterations:
            break
        if iteration == 0 and robust:
            scale = max(1.48 * np.median(errors), _LEAST_SCALE) if count else _LEAST_SCALE
        step, solved = solve_positive(H, b)
        if not solved:
            return T, errors, False
        T = product(exp_se3(step), T)
        if np.sqrt(np.sum(step * step)) < _SMALLEST_STEP:
            break
    return T, errors, True
