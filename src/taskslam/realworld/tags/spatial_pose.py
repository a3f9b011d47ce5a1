"""Poses in space from coplanar points: a tag, or all tags of a bundle at once (PnP).

IPPE (Collins, Bartoli: Infinitesimal plane-based pose estimation, IJCV 109, 2014) gives both poses that a planar target
allows; Gauss-Newton on the reprojection error finishes each. It is written out here because OpenCV's is NaN for exact
corners of a frontal tag, the very case of a camera under a ceiling: in 50 of 200 tried with OpenCV 5.0, whichever way
the target's z points. Here points are given in a frame whose z points away from the camera.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray
from taskslam.realworld.tags.tag_plane import CORNER_NOISE_PX

AMBIGUOUS = 0.4
"""Above this ratio of the two reprojection errors the smaller one proves nothing (about one in ten is wrong)."""

_STEPS = 15
_CONVERGED = 1e-12


@dataclass(frozen=True, eq=False)
class SpatialFit:
    """T_camera_target: (4, 4). covariance: (6, 6) of a small motion (rotation, translation) in the optical frame.

    residual_px: root mean squared distance of the points, px of an image without distortion.
    """

    T_camera_target: FloatArray
    covariance: FloatArray
    residual_px: float


def both_poses(rays: FloatArray, points: FloatArray, focal: float) -> list[SpatialFit]:
    """Poses of a planar target seen along normalised rays (P, 2), best first: two, or one where they coincide.

    points: (P, 2), m, in the target's plane, in a frame whose z points away from the camera; P >= 4. Empty where no
    pose puts the target in front of the camera.
    """
    flat = np.column_stack([points, np.zeros(len(points))])
    fits: list[SpatialFit] = []
    for R in _both_rotations(rays, points):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R, _translation(R, rays, flat)
        fit = _refine(T, rays, flat, focal) if np.isfinite(T).all() else None
        if fit is not None and not any(_same(fit, other) for other in fits):
            fits.append(fit)
    return sorted(fits, key=lambda fit: fit.residual_px)


def choose_pose(fits: list[SpatialFit], up: FloatArray) -> SpatialFit:
    """The better of two poses; where their errors are alike, the one whose target lies as expected.

    up: (3,) unit vector in the optical frame along which the target's z is expected, from how the camera is mounted.
    """
    if len(fits) == 2 and fits[0].residual_px > AMBIGUOUS * fits[1].residual_px:
        return max(fits, key=lambda fit: float(fit.T_camera_target[:3, 2] @ up))
    return fits[0]


def _both_rotations(rays: FloatArray, points: FloatArray) -> list[FloatArray]:
    """IPPE: what the homography does near the middle of the points leaves two rotations of their plane."""
    middle = points.mean(axis=0)
    H = _homography(points - middle, rays)
    if H is None:
        return []
    p, q = v = H[:2, 2]
    J = H[:2, :2] - np.outer(v, H[2, :2])
    Rv = _turn_to(np.array([p, q, 1.0]))
    try:
        A = np.linalg.solve(Rv[:2, :2] - np.outer(v, Rv[2, :2]), J)
        largest = float(np.linalg.norm(A, 2))
    except np.linalg.LinAlgError:
        return []
    if not largest > 0:
        return []
    A = A / largest
    rest = np.eye(2) - A.T @ A
    b = np.sqrt(np.maximum(np.diag(rest), 0.0)) * (1.0, 1.0 if rest[0, 1] >= 0 else -1.0)
    found = []
    for last_row in (b, -b):
        columns = np.vstack([A, last_row])
        U, _, Vt = np.linalg.svd(np.column_stack([columns, np.cross(columns[:, 0], columns[:, 1])]))
        found.append(Rv @ U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt)
    return found


def _homography(points: FloatArray, rays: FloatArray) -> FloatArray | None:
    """(3, 3) with last element 1, points to rays, by the direct linear transform; None for rays all in one place."""
    scale, centre = float(np.abs(points).max()), rays.mean(axis=0)
    spread = float(np.abs(rays - centre).max())
    if not (scale > 0 and 0 < spread < np.inf):
        return None
    x, y = (points / scale).T
    u, v = ((rays - centre) / spread).T
    one, zero = np.ones_like(x), np.zeros_like(x)
    rows = [np.column_stack([x, y, one, zero, zero, zero, -u * x, -u * y, -u])]
    rows += [np.column_stack([zero, zero, zero, x, y, one, -v * x, -v * y, -v])]
    H = np.linalg.svd(np.concatenate(rows))[2][-1].reshape(3, 3)
    back = np.array([[spread, 0, centre[0]], [0, spread, centre[1]], [0, 0, 1]])
    H = back @ H @ np.diag([1 / scale, 1 / scale, 1.0])
    return np.asarray(H / H[2, 2]) if abs(H[2, 2]) > 1e-12 * np.abs(H).max() else None


def _turn_to(direction: FloatArray) -> FloatArray:
    """The shortest rotation that takes the z axis to a direction in front of it."""
    x, y, z = direction / np.linalg.norm(direction)
    return np.array(
        [[1 - x * x / (1 + z), -x * y / (1 + z), x], [-x * y / (1 + z), 1 - y * y / (1 + z), y], [-x, -y, z]]
    )


def _translation(R: FloatArray, rays: FloatArray, points: FloatArray) -> FloatArray:
    """Least squares: each ray is parallel to its point, turned and moved."""
    turned = points @ R.T
    u, v = rays.T
    one, zero = np.ones_like(u), np.zeros_like(u)
    A = np.concatenate([np.column_stack([one, zero, -u]), np.column_stack([zero, one, -v])])
    b = np.concatenate([u * turned[:, 2] - turned[:, 0], v * turned[:, 2] - turned[:, 1]])
    return np.asarray(np.linalg.lstsq(A, b, rcond=None)[0], np.float64)


def _refine(T: FloatArray, rays: FloatArray, points: FloatArray, focal: float) -> SpatialFit | None:
    """Gauss-Newton from a pose near by; None if it leaves the front of the camera."""
    for _ in range(_STEPS):
        errors, slopes = _reprojection(T, rays, points)
        if errors is None:
            return None
        step = -np.asarray(np.linalg.lstsq(slopes, errors, rcond=None)[0], np.float64)
        T = _small_motion(step) @ T
        if np.abs(step).max() < _CONVERGED:
            break
    errors, slopes = _reprojection(T, rays, points)
    if errors is None or not np.isfinite(errors).all():
        return None
    squared = float(errors @ errors) * focal**2
    noise = max(np.sqrt(squared / (len(errors) - 6)), CORNER_NOISE_PX) / focal
    covariance = np.linalg.pinv(slopes.T @ slopes) * noise**2
    return SpatialFit(T, covariance, float(np.sqrt(squared / len(points))))


def _reprojection(T: FloatArray, rays: FloatArray, points: FloatArray) -> tuple[FloatArray | None, FloatArray]:
    """Residuals (2P,) and slopes (2P, 6) by a small rotation and translation in the optical frame; None behind it."""
    at = points @ T[:3, :3].T + T[:3, 3]
    if not (at[:, 2] > 0).all():
        return None, np.empty((0, 6))
    image = at[:, :2] / at[:, 2:]
    moves = np.zeros((len(at), 3, 6))
    moves[:, 0, 1], moves[:, 0, 2] = at[:, 2], -at[:, 1]
    moves[:, 1, 0], moves[:, 1, 2] = -at[:, 2], at[:, 0]
    moves[:, 2, 0], moves[:, 2, 1] = at[:, 1], -at[:, 0]
    moves[:, :, 3:] = np.eye(3)
    slopes = (moves[:, :2] - image[:, :, None] * moves[:, 2:]) / at[:, 2, None, None]
    return (image - rays).ravel(), slopes.reshape(-1, 6)


def _small_motion(step: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec(step[:3]).as_matrix(), step[3:]
    return T


def _same(one: SpatialFit, other: SpatialFit) -> bool:
    return bool(np.abs(one.T_camera_target - other.T_camera_target).max() < 1e-6)
