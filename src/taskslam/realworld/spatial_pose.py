"""Poses in space from coplanar points: a tag, or all tags of a bundle at once (PnP).

IPPE (Collins, Bartoli: Infinitesimal plane-based pose estimation, IJCV 109, 2014) gives both poses that a planar target
allows; Gauss-Newton on the reprojection error finishes each. Points are given in a frame whose z points away from the
camera: with z towards it the rotation vector inside OpenCV lies near pi, where exact corners give NaN.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray
from taskslam.realworld.extra import load_opencv
from taskslam.realworld.tag_plane import CORNER_NOISE_PX

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
    cv2 = load_opencv()
    flat = np.column_stack([points, np.zeros(len(points))])
    try:
        _, rotations, translations, _ = cv2.solvePnPGeneric(flat, rays, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    except cv2.error:
        return []
    fits: list[SpatialFit] = []
    for rotation, translation in zip(rotations, translations, strict=True):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = cv2.Rodrigues(rotation)[0], translation.ravel()
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
