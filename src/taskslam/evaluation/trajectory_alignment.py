"""Laying an estimated trajectory on the ground truth: rigidly, with scale, by yaw and position alone, or not at all.

Which one is right is a property of the estimator: what it cannot observe must be given to it, and nothing else. Vision
alone observes no frame (SE(3)), one camera no scale either (Sim(3)); with an IMU, gravity gives roll and pitch, so
that only yaw and position are free (4 degrees of freedom); a method in the map's frame needs no alignment. The origin
alone is for drift: the run begins where the ground truth does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from taskslam.errors import TrajectoryError
from taskslam.geometry import FloatArray, invert_se3
from taskslam.record.trajectories import SpatialTrajectory

# Below this share of the greatest extent, an extent is noise of the arithmetic.
_DEGENERATE = 1e-12
_STRAIGHT, _SURE = 0.1, 3.0


class Alignment(StrEnum):
    """What is free when an estimate is laid on the ground truth."""

    SE3 = "se3"
    SIM3 = "sim3"
    YAW = "yaw"
    ORIGIN = "origin"
    NONE = "none"


@dataclass(frozen=True)
class Similarity:
    """x -> scale R x + t. rotation: (3, 3); translation: (3,) metres."""

    rotation: FloatArray
    translation: FloatArray
    scale: float = 1.0

    def apply(self, trajectory: SpatialTrajectory) -> SpatialTrajectory:
        """The trajectory in the frame of the ground truth."""
        from scipy.spatial.transform import Rotation

        positions = self.scale * trajectory.positions @ self.rotation.T + self.translation
        turned = Rotation.from_matrix(self.rotation) * Rotation.from_quat(trajectory.quaternions)
        return SpatialTrajectory(trajectory.stamps, positions, turned.as_quat())


def align(
    estimate: SpatialTrajectory, reference: SpatialTrajectory, kind: Alignment, first: int | None = None
) -> Similarity:
    """The transform of `kind` that brings associated positions closest in the sum of squares; rows belong together.

    SE(3), Sim(3): S. Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI
    13 (4), 1991, eqs. (34) to (43). Yaw: the same sum, minimised over rotations about z in closed form: with C = sum of
    (y - mean y)(x - mean x)^T, trace(Rz(a)^T C) is greatest at a = atan2(C10 - C01, C00 + C11).

    Origin: the first pose of the estimate comes to lie on that of the reference, as evo's `align_origin` does it.
    first: only so many poses from the start determine the transform; None for all.

    Raises TrajectoryError if the positions do not determine it: a robot that stood still, or drove along a line.
    """
    if kind is Alignment.NONE:
        return Similarity(np.eye(3), np.zeros(3))
    x, y = estimate.positions[:first], reference.positions[:first]
    if not len(x):
        raise TrajectoryError("no pose to align by; expected poses that are associated with the ground truth")
    if kind is Alignment.ORIGIN:
        T = reference[:1].matrices()[0] @ invert_se3(estimate[:1].matrices()[0])
        return Similarity(T[:3, :3], T[:3, 3])
    mean_x, mean_y = x.mean(axis=0), y.mean(axis=0)
    dx, dy = x - mean_x, y - mean_y
    covariance = dy.T @ dx / len(x)
    if kind is Alignment.YAW:
        rotation, scale = _best_yaw(covariance), 1.0
    else:
        rotation, scale = _umeyama(covariance, float(np.einsum("ij,ij->", dx, dx)) / len(x))
    scale = scale if kind is Alignment.SIM3 else 1.0
    return Similarity(rotation, mean_y - scale * rotation @ mean_x, scale)


def noise_about_a_line(aligned: SpatialTrajectory, reference: SpatialTrajectory) -> tuple[float, float] | None:
    """Whether an alignment's rotation about the line of a nearly straight drive rests on nothing but errors.

    Returns the spread (standard deviation, m) of the reference across its line and the errors across it (root mean
    square of an axis, m), or None where the spread is at least a tenth of that along the line, or three times the
    errors: then the drive itself says how it is turned. A straight corridor with a millimetre of noise turns anyhow.
    """
    centred = reference.positions - reference.positions.mean(axis=0)
    spread, axes = np.linalg.eigh(centred.T @ centred / len(centred))
    across = float(np.sqrt(max(spread[1], 0.0)))
    errors = (aligned.positions - reference.positions) @ axes[:, :2]
    noise = float(np.sqrt(np.mean(errors * errors)))
    straight = across < _STRAIGHT * math.sqrt(max(spread[2], 0.0)) and across < _SURE * noise
    return (across, noise) if straight else None


def _umeyama(covariance: FloatArray, variance: float) -> tuple[FloatArray, float]:
    u, d, vt = np.linalg.svd(covariance)
    if not d[1] > _DEGENERATE * d[0]:
        raise TrajectoryError(
            "its positions lie on a line or a point, which leaves the rotation open; "
            "expected motion in a plane at least, or another alignment (yaw, none)"
        )
    signs = np.array([1.0, 1.0, np.linalg.det(u) * np.linalg.det(vt)])
    signs[2] = -1.0 if signs[2] < 0 else 1.0
    return (u * signs) @ vt, float(d @ signs) / variance


def _best_yaw(covariance: FloatArray) -> FloatArray:
    sine, cosine = covariance[1, 0] - covariance[0, 1], covariance[0, 0] + covariance[1, 1]
    if not math.hypot(sine, cosine) > 0.0:
        raise TrajectoryError("its positions do not move in the horizontal plane, which leaves yaw open")
    c, s = cosine / math.hypot(sine, cosine), sine / math.hypot(sine, cosine)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
