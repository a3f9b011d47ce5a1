"""Where the points of the map are seen in a new image: each is projected, and its patch aligned, one point a cell."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.feature_alignment import SIDE, align_patch, warp_patch
from taskslam.slam.vision.pinhole import Pinhole

MATCHED, FAILED, NOT_TRIED = 1, -1, 0


@njit(cache=True)
def match_points(
    keyframes: Any,
    image: Any,
    pinhole: Pinhole,
    T_camera_hosts: FloatArray,
    hosts: npt.NDArray[np.int64],
    pixels: FloatArray,
    levels: npt.NDArray[np.int64],
    normals: FloatArray,
    inverse_depths: FloatArray,
    order: npt.NDArray[np.int64],
    cell: int,
    most: int,
    iterations: int,
) -> tuple[npt.NDArray[np.int64], FloatArray, FloatArray]:
    """What became of each point (N,), where it is seen (N, 2), and along which normal its place is known (N, 2).

    keyframes: of each level, (K, H, W) images; image: levels of the new one. T_camera_hosts: (K, 4, 4). Points are
    tried in `order` until `most` are matched; a cell of `cell` pixels takes one.
    """
    f, cx, cy = pinhole.f, pinhole.cx, pinhole.cy
    rows, columns = image[0].shape
    free = np.ones((rows // cell + 1, columns // cell + 1), np.bool_)
    state = np.zeros(len(hosts), np.int64)
    seen, along = np.zeros((len(hosts), 2)), np.zeros((len(hosts), 2))
    A, B = np.empty((2, 2)), np.empty((2, 2))
    count = 0
    for n in order:
        if count == most:
            break
        P, d = T_camera_hosts[hosts[n]], inverse_depths[n]
        reference = 2.0 ** levels[n]
        u0, v0 = 0.0, 0.0
        inside = True
        for k in range(3):  # the point, and a few pixels to its right and below
            x = (pixels[n, 0] + (4.0 if k == 1 else 0.0) - cx) / f
            y = (pixels[n, 1] + (4.0 if k == 2 else 0.0) - cy) / f
            q2 = P[2, 0] * x + P[2, 1] * y + P[2, 2] + d * P[2, 3]
            if q2 < 1e-2:
                inside = False
                break
            u = f * (P[0, 0] * x + P[0, 1] * y + P[0, 2] + d * P[0, 3]) / q2 + cx
            v = f * (P[1, 0] * x + P[1, 1] * y + P[1, 2] + d * P[1, 3]) / q2 + cy
            if k == 0:
                u0, v0 = u, v
            else:
                A[0, k - 1], A[1, k - 1] = (u - u0) / 4.0, (v - v0) / 4.0
        if not inside or not (u0 >= SIDE and v0 >= SIDE and u0 < columns - SIDE and v0 < rows - SIDE):
            continue
        i, j = int((v0 + 0.5) / cell), int((u0 + 0.5) / cell)
        if not free[i, j]:
            continue
        determinant = A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
        if not 0.05 < determinant < 20.0:
            continue
        level, area = 0, determinant * reference * reference
        while area > 3.0 and level < len(image) - 1:
            level += 1
            area *= 0.25
        here = 2.0**level
        back = here / (determinant * reference)
        B[0, 0], B[0, 1], B[1, 0], B[1, 1] = A[1, 1] * back, -A[0, 1] * back, -A[1, 0] * back, A[0, 0] * back
        state[n] = FAILED
        x, y = (pixels[n, 0] + 0.5) / reference - 0.5, (pixels[n, 1] + 0.5) / reference - 0.5
        patch, whole = warp_patch(keyframes[levels[n]][hosts[n]], x, y, B)
        if not whole:
            continue
        nx = (A[1, 1] * normals[n, 0] - A[1, 0] * normals[n, 1]) / determinant
        ny = (-A[0, 1] * normals[n, 0] + A[0, 0] * normals[n, 1]) / determinant
        size = np.sqrt(nx * nx + ny * ny)
        if size > 0.0:
            nx, ny = nx / size, ny / size
        start = ((u0 + 0.5) / here - 0.5, (v0 + 0.5) / here - 0.5)
        x, y, found = align_patch(image[level], patch, start, (nx, ny), iterations)
        if found:
            state[n] = MATCHED
            seen[n, 0], seen[n, 1] = (x + 0.5) * here - 0.5, (y + 0.5) * here - 0.5
            along[n, 0], along[n, 1] = nx, ny
            free[i, j] = False
            count += 1
    return state, seen, along
