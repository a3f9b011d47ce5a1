"""What a rectified pair says of a landmark, and what is left of it once the landmark is projected out.

An observation is (3,): x, y in the left image and x in the right, normalised; y is the same in both. The published
filter takes four numbers a pair; in a rectified pair the fourth says the third again.
"""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.cholesky import solve_positive

ROWS = 3


@njit(cache=True)
def seen_from(R: FloatArray, p: FloatArray, landmark: FloatArray, baseline: float) -> FloatArray:
    """(3,) observation of a landmark (world, m) by a left camera at (R, p) in the world; nan if not in front of it."""
    at = R.T @ (landmark - p)
    if at[2] <= 0.0:
        return np.full(ROWS, np.nan)
    return np.array([at[0] / at[2], at[1] / at[2], (at[0] - baseline) / at[2]])


@njit(cache=True)
def derivatives(R: FloatArray, p: FloatArray, landmark: FloatArray, baseline: float):  # type: ignore[no-untyped-def]
    """Of an observation by the pose's error (rotation in the camera, position), (3, 6), and by the landmark, (3, 3)."""
    at = R.T @ (landmark - p)
    depth = at[2]
    by_point = np.array(
        [
            [1.0 / depth, 0.0, -at[0] / depth**2],
            [0.0, 1.0 / depth, -at[1] / depth**2],
            [1.0 / depth, 0.0, -(at[0] - baseline) / depth**2],
        ]
    )
    by_landmark = by_point @ R.T
    across = np.array([[0.0, -at[2], at[1]], [at[2], 0.0, -at[0]], [-at[1], at[0], 0.0]])
    by_pose = np.empty((ROWS, 6))
    by_pose[:, :3] = by_point @ across
    by_pose[:, 3:] = -by_landmark
    return by_pose, by_landmark


@njit(cache=True)
def project_out(H_f: FloatArray, H: FloatArray, r: FloatArray) -> None:
    """Turn rows so that only the first three depend on the landmark, in place; the rest is free of it.

    H_f: (M, 3), H: (M, N), r: (M,). Householder reflections (Mourikis, eq. (23): the left null space).
    """
    rows, columns = H.shape
    v = np.empty(rows)
    for k in range(3):
        square = 0.0
        for i in range(k, rows):
            square += H_f[i, k] ** 2
        length = math.sqrt(square)
        if length == 0.0:
            continue
        alpha = -length if H_f[k, k] > 0.0 else length
        v[k:] = H_f[k:, k]
        v[k] -= alpha
        scale = 0.0
        for i in range(k, rows):
            scale += v[i] * v[i]
        scale = 2.0 / scale
        for j in range(k, 3):
            total = 0.0
            for i in range(k, rows):
                total += v[i] * H_f[i, j]
            for i in range(k, rows):
                H_f[i, j] -= scale * total * v[i]
        for j in range(columns):
            total = 0.0
            for i in range(k, rows):
                total += v[i] * H[i, j]
            if total != 0.0:
                for i in range(k, rows):
                    H[i, j] -= scale * total * v[i]
        total = 0.0
        for i in range(k, rows):
            total += v[i] * r[i]
        for i in range(k, rows):
            r[i] -= scale * total * v[i]


@njit(cache=True)
def triangulate(rotations: FloatArray, positions: FloatArray, seen: FloatArray, baseline: float):  # type: ignore[no-untyped-def]
    """A landmark from (M, 3) observations by poses (M, 3, 3) and (M, 3); returns it and whether it can be believed.

    Levenberg and Marquardt on the reprojection errors, from the first pair's disparity.
    """
    first = seen[0]
    disparity = first[0] - first[2]
    landmark = np.zeros(3)
    if not disparity > 1e-4:
        return landmark, False
    depth = baseline / disparity
    landmark = rotations[0] @ (depth * np.array([first[0], first[1], 1.0])) + positions[0]
    damping, cost = 1e-3, np.inf
    for m in range(len(seen)):
        cost = (0.0 if m == 0 else cost) + np.sum(
            (seen_from(rotations[m], positions[m], landmark, baseline) - seen[m]) ** 2
        )
    for _ in range(10):
        A, b = np.zeros((3, 3)), np.zeros(3)
        for m in range(len(seen)):
            r = seen_from(rotations[m], positions[m], landmark, baseline) - seen[m]
            if not np.isfinite(r[0]):
                return landmark, False
            J = derivatives(rotations[m], positions[m], landmark, baseline)[1]
            A += J.T @ J
            b += J.T @ r
        for k in range(3):
            A[k, k] *= 1.0 + damping
            A[k, k] += 1e-12
        step, positive = solve_positive(A, b)
        if not positive:
            return landmark, False
        tried = landmark - step
        new = 0.0
        for m in range(len(seen)):
            new += np.sum((seen_from(rotations[m], positions[m], tried, baseline) - seen[m]) ** 2)
        if new < cost:
            landmark, cost, damping = tried, new, 0.1 * damping
            if np.max(np.abs(step)) < 1e-5:
                break
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    for m in range(len(seen)):
        if not np.isfinite(seen_from(rotations[m], positions[m], landmark, baseline)[0]):
            return landmark, False
    return landmark, bool(np.isfinite(cost))
