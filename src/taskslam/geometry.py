"""Planar and spatial poses, as one small value type and as functions over N poses at once.

Frames follow REP-105: `T_a_b` is the pose of frame b in frame a and maps coordinates in b to a.
Angles are radians, lengths metres. A pose array in SE(2) has shape (N, 3) with columns x, y, theta.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

_IDENTITY = np.eye(4)

OPTICAL_IN_BODY = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""`T_body_optical`: optical x right, y down, z forward; body x forward, y left, z up (REP-103)."""


@dataclass(frozen=True, slots=True)
class SE2:
    """A planar pose (x, y, theta); theta is kept as given and never wrapped silently."""

    x: float = 0.0
    y: float = 0.0
    theta: float = 0.0

    def __matmul__(self, other: SE2) -> SE2:
        """Compose: `T_a_c = T_a_b @ T_b_c`."""
        c, s = math.cos(self.theta), math.sin(self.theta)
        return SE2(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            wrap_angle(self.theta + other.theta),
        )

    def inverse(self) -> SE2:
        """`T_b_a` from `T_a_b`."""
        c, s = math.cos(self.theta), math.sin(self.theta)
        return SE2(-c * self.x - s * self.y, s * self.x - c * self.y, wrap_angle(-self.theta))

    def array(self) -> FloatArray:
        """(3,) array x, y, theta."""
        return np.array([self.x, self.y, self.theta])

    def matrix(self) -> FloatArray:
        """Homogeneous (4, 4) matrix in SE(3) with z, roll and pitch zero."""
        c, s = math.cos(self.theta), math.sin(self.theta)
        return np.array([[c, -s, 0, self.x], [s, c, 0, self.y], [0, 0, 1, 0], [0, 0, 0, 1.0]])

    @staticmethod
    def from_matrix(T: FloatArray) -> SE2:
        """Project a (4, 4) SE(3) pose: x, y and yaw = atan2(R10, R00) (protocol 5.1)."""
        return SE2(float(T[0, 3]), float(T[1, 3]), math.atan2(T[1, 0], T[0, 0]))

    def is_finite(self) -> bool:
        """Whether no component is NaN or infinite."""
        return math.isfinite(self.x) and math.isfinite(self.y) and math.isfinite(self.theta)

    def distance_to(self, other: SE2) -> float:
        """Planar distance in metres."""
        return math.hypot(self.x - other.x, self.y - other.y)

    def in_words(self, decimals: int = 2) -> str:
        """`(1.50, -2.00, 0.79)`, in metres and radians, for sentences."""
        return f"({self.x:.{decimals}f}, {self.y:.{decimals}f}, {self.theta:.{decimals}f})"


def wrap_angle(angle: float) -> float:
    """One angle wrapped to [-pi, pi]; an angle already there is returned bit for bit."""
    if -math.pi <= angle <= math.pi:
        return angle
    return math.atan2(math.sin(angle), math.cos(angle))


def wrap(angles: npt.ArrayLike) -> FloatArray:
    """Angles of any shape wrapped to [-pi, pi] (protocol 5.2)."""
    a = np.asarray(angles, dtype=np.float64)
    return np.arctan2(np.sin(a), np.cos(a))


def compose(a: FloatArray, b: FloatArray) -> FloatArray:
    """Row-wise SE(2) composition of (..., 3) pose arrays, broadcasting."""
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    return np.stack(
        [
            a[..., 0] + c * b[..., 0] - s * b[..., 1],
            a[..., 1] + s * b[..., 0] + c * b[..., 1],
            wrap(a[..., 2] + b[..., 2]),
        ],
        axis=-1,
    )


def invert(a: FloatArray) -> FloatArray:
    """Row-wise SE(2) inverse of a (..., 3) pose array."""
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    return np.stack(
        [-c * a[..., 0] - s * a[..., 1], s * a[..., 0] - c * a[..., 1], wrap(-a[..., 2])],
        axis=-1,
    )


def transform_points(pose: SE2, points: FloatArray) -> FloatArray:
    """Map (N, 2) points given in frame b to frame a by `T_a_b` = pose."""
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    moved: FloatArray = points @ np.array([[c, s], [-s, c]]) + np.array([pose.x, pose.y])
    return moved


def mean_heading(theta: FloatArray) -> float:
    """Circular mean of (N,) headings: atan2(mean sin, mean cos) (protocol 5.2)."""
    return math.atan2(float(np.mean(np.sin(theta))), float(np.mean(np.cos(theta))))


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> FloatArray:
    """(3, 3) rotation Rz(yaw) Ry(pitch) Rx(roll): the fixed-axis convention of URDF and SDF."""
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def pose_from_xyz_rpy(xyz: npt.ArrayLike, rpy: npt.ArrayLike) -> FloatArray:
    """(4, 4) pose from a translation in metres and fixed-axis roll, pitch, yaw in radians."""
    T = np.eye(4)
    T[:3, :3] = rotation_from_rpy(*np.asarray(rpy, dtype=np.float64))
    T[:3, 3] = np.asarray(xyz, dtype=np.float64)
    return T


def invert_se3(T: FloatArray) -> FloatArray:
    """Inverse of a (4, 4) rigid transform."""
    out = np.eye(4)
    out[:3, :3] = T[:3, :3].T
    out[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return out


def is_rigid(T: FloatArray, tolerance: float = 1e-6) -> bool:
    """Whether T is a finite (4, 4) rigid transform: R orthonormal with determinant +1, last row 0 0 0 1."""
    if T.shape != (4, 4) or not np.isfinite(T).all():
        return False
    R = T[:3, :3]
    return bool(
        (np.abs(R @ R.T - _IDENTITY[:3, :3]) <= tolerance).all()
        and np.linalg.det(R) > 0
        and (np.abs(T[3] - _IDENTITY[3]) <= tolerance).all()
    )
