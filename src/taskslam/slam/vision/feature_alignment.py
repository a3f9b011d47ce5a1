"""Where in an image a patch of a keyframe lies, to a fraction of a pixel (Forster et al. 2017, section IV.B; KLT).

The patch of 8 x 8 pixels is warped as the camera's motion and the point's depth demand, and shifted, its contrast and
brightness changed, until the squared differences are least: inverse-compositional (Baker and Matthews 2004). An edgelet
is shifted along its normal alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.cholesky import solve_positive
from taskslam.slam.vision.pyramid import GreyImage, bilinear

SIDE = 8
_PADDED = SIDE + 2  # a pixel more all round, for gradients
_FARTHEST = 4.0  # pixels from where it was expected
_CONVERGED = 0.03  # pixels of a step


@njit(cache=True)
def warp_patch(image: GreyImage, x: float, y: float, A: FloatArray) -> tuple[FloatArray, bool]:
    """(10, 10) grey levels about (x, y), pixel (i, j) of the patch being at (x, y) + A (j, i); False: off the image."""
    rows, columns = image.shape
    patch = np.empty((_PADDED, _PADDED))
    half = 0.5 * (_PADDED - 1)
    for i in range(_PADDED):
        for j in range(_PADDED):
            u = x + A[0, 0] * (j - half) + A[0, 1] * (i - half)
            v = y + A[1, 0] * (j - half) + A[1, 1] * (i - half)
            if not (u >= 0.0 and v >= 0.0 and u < columns - 1 and v < rows - 1):
                return patch, False
            patch[i, j] = bilinear(image, u, v)
    return patch, True


@njit(cache=True)
def align_patch(image: GreyImage, patch: FloatArray, start: Any, normal: Any, iterations: int) -> Any:
    """X, y at which the image shows a `warp_patch`, and whether that was found near the `start`.

    normal: unit direction along which alone it may move, or (0, 0): any.
    """
    rows, columns = image.shape
    x, y = start
    edge = normal[0] != 0.0 or normal[1] != 0.0
    H, J = np.zeros((4, 4)), np.empty((SIDE * SIDE, 4))
    mean = 0.0
    for i in range(SIDE):
        for j in range(SIDE):
            mean += patch[i + 1, j + 1]
    mean /= SIDE * SIDE
    for i in range(SIDE):
        for j in range(SIDE):
            gx = 0.5 * (patch[i + 1, j + 2] - patch[i + 1, j])
            gy = 0.5 * (patch[i + 2, j + 1] - patch[i, j + 1])
            k = i * SIDE + j
            J[k, 0], J[k, 1] = (gx * normal[0] + gy * normal[1], 0.0) if edge else (gx, gy)
            J[k, 2], J[k, 3] = mean - patch[i + 1, j + 1], -1.0
            for a in range(4):
                for b in range(4):
                    H[a, b] += J[k, a] * J[k, b]
    for a in range(4):
        H[a, a] += 1e-6 * H[a, a] + 1e-3
    contrast, brightness = 1.0, mean
    half = 0.5 * (SIDE - 1)
    for _ in range(iterations):
        x0, y0 = x - half, y - half
        if not (x0 >= 0.0 and y0 >= 0.0 and x0 + SIDE < columns and y0 + SIDE < rows):
            return x, y, False
        slope = np.zeros(4)
        for i in range(SIDE):
            for j in range(SIDE):
                k = i * SIDE + j
                r = bilinear(image, x0 + j, y0 + i) - contrast * (patch[i + 1, j + 1] - mean) - brightness
                for a in range(4):
                    slope[a] -= J[k, a] * r
        step, solved = solve_positive(H, slope)
        if not solved:
            return x, y, False
        dx, dy = (step[0] * normal[0], step[0] * normal[1]) if edge else (step[0], step[1])
        x, y = x + dx, y + dy
        contrast += step[2]
        brightness += step[3]
        if abs(x - start[0]) > _FARTHEST or abs(y - start[1]) > _FARTHEST:
            return x, y, False
        if dx * dx + dy * dy < _CONVERGED * _CONVERGED:
            return x, y, 0.2 < contrast < 5.0
    return x, y, False
