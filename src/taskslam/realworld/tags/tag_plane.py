"""The plane in which a tag moves, and where in it a tag lies: three unknowns, so no ambiguity and no tilt leaks in.

The four corner rays of a tag meet the known plane in four points; the square of known size that fits them best is the
pose (known-plane SE(2) estimation). The closed form (Kabsch in the plane) starts two Gauss-Newton steps on the
reprojection error, which also give the covariance.

A plane's frame: z up, against gravity; origin at the foot of the camera's perpendicular; x as the image's x, y to make
it right-handed. A tag's frame: x to the top of the artwork, z up. So a robot with its tag's top forward drives along x.
A tag below the camera (on a robot) is seen from above, a tag above it (on a ceiling) from below: `height` has the sign.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray, wrap

CORNER_NOISE_PX = 0.05
"""Standard deviation per coordinate of a corner that is assumed at least: the detector's own is 0.03 to 0.1 px."""

_STEPS = 3
_SINGULAR = 1e15


@dataclass(frozen=True, eq=False)
class TagPlane:
    """Where a plane lies in a camera's optical frame. up: (3,) unit vector. height: m, plane above camera (signed)."""

    up: FloatArray
    height: float

    @property
    def T_camera_plane(self) -> FloatArray:  # noqa: N802 the frames' names
        """(4, 4) pose of the plane's frame in the optical frame."""
        x = np.array([1.0, 0.0, 0.0]) - self.up[0] * self.up
        x /= np.linalg.norm(x)
        T = np.eye(4)
        T[:3, 0], T[:3, 1], T[:3, 2] = x, np.cross(self.up, x), self.up
        T[:3, 3] = self.height * self.up
        return T

    @property
    def from_above(self) -> bool:
        """Whether the camera looks down on the plane."""
        return self.height < 0

    @property
    def tilt(self) -> float:
        """Angle (rad) between the optical axis and the plane's normal."""
        return float(np.arccos(np.clip(abs(self.up[2]), 0.0, 1.0)))

    def meet(self, rays: FloatArray) -> FloatArray:
        """(..., 2) points, m, in the plane's frame where normalised rays (..., 2) meet it; NaN where they do not."""
        directions = np.concatenate([rays, np.ones((*rays.shape[:-1], 1))], axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = self.height / (directions @ self.up)
        points = np.where(depth > 0, depth, np.nan)[..., None] * directions
        return np.asarray(points @ self.T_camera_plane[:3, :2])


@dataclass(frozen=True, eq=False)
class PlanarFit:
    """Poses of N tags in a plane. poses: (N, 3) x, y in m and theta in rad. covariances: (N, 3, 3) of the same.

    residual_px: (N,) root of the mean squared distance, px of an image without distortion, between the corners and
    those of the fitted square. scale: (N,) how large the square looks against its true size, 1 if plane and size fit.
    side_px: (N,) mean side in the image. errors: (N, P, 2) corner residuals, px.
    """

    poses: FloatArray
    covariances: FloatArray
    residual_px: FloatArray
    scale: FloatArray
    side_px: FloatArray
    errors: FloatArray


def tag_square(size: float, from_above: bool) -> FloatArray:
    """(4, 2) corners TL, TR, BR, BL in the tag's frame (x to the artwork's top, z up), m. size: side of the square."""
    half = size / 2
    left = half if from_above else -half
    return np.array([[half, left], [half, -left], [-half, -left], [-half, left]])


def fit_in_plane(rays: FloatArray, points: FloatArray, plane: TagPlane, focal: float) -> PlanarFit:
    """Poses in a known plane of N rigid sets of P points, seen along normalised rays (N, P, 2).

    points: (P, 2), m, in the frame of the rigid set. focal: px, turns normalised residuals into pixels. A set whose
    rays do not all meet the plane has NaN throughout.
    """
    seen = plane.meet(rays)
    centre = points.mean(axis=0)
    model = (points - centre) @ np.array([1, 1j])
    found = seen @ np.array([1, 1j])
    spin = ((found - found.mean(axis=1, keepdims=True)) * model.conj()).sum(axis=1)
    scale = np.abs(spin) / (np.abs(model) ** 2).sum()
    theta = np.angle(spin)
    origin = found.mean(axis=1) - np.exp(1j * theta) * (centre @ np.array([1, 1j]))
    poses = np.stack([origin.real, origin.imag, theta], axis=1)

    T = plane.T_camera_plane
    for _ in range(_STEPS):
        errors, slopes = _reprojection(poses, rays, points, T)
        normal = slopes.transpose(0, 2, 1) @ slopes
        poses = poses - np.linalg.solve(_filled(normal), slopes.transpose(0, 2, 1) @ errors[..., None])[..., 0]
    errors, slopes = _reprojection(poses, rays, points, T)
    poses[:, 2] = wrap(poses[:, 2])

    squared = (errors**2).sum(axis=1) * focal**2
    spare = 2 * len(points) - 3
    noise = np.maximum(np.sqrt(squared / spare), CORNER_NOISE_PX) / focal
    normal = slopes.transpose(0, 2, 1) @ slopes
    covariances = np.linalg.inv(_filled(normal)) * (noise**2)[:, None, None]
    lost = ~np.isfinite(poses).all(axis=1)
    covariances[lost] = np.nan
    return PlanarFit(
        poses=poses,
        covariances=covariances,
        residual_px=np.sqrt(squared / len(points)),
        scale=scale,
        side_px=_mean_side(rays) * focal,
        errors=errors.reshape(-1, len(points), 2) * focal,
    )


def _reprojection(
    poses: FloatArray, rays: FloatArray, points: FloatArray, T_camera_plane: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Residuals (N, 2P) in normalised image coordinates and their slopes (N, 2P, 3) by x, y, theta."""
    c, s = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
    x_axis, y_axis, origin = T_camera_plane[:3, 0], T_camera_plane[:3, 1], T_camera_plane[:3, 3]
    dx, dy = c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]
    at = origin + (poses[:, 0, None] + dx)[..., None] * x_axis + (poses[:, 1, None] + dy)[..., None] * y_axis
    image = at[..., :2] / at[..., 2:]
    turn = -dy[..., None] * x_axis + dx[..., None] * y_axis
    moves = np.stack([np.broadcast_to(x_axis, at.shape), np.broadcast_to(y_axis, at.shape), turn], axis=-1)
    slopes = (moves[..., :2, :] - image[..., None] * moves[..., 2:, :]) / at[..., 2, None, None]
    return (image - rays).reshape(len(poses), -1), slopes.reshape(len(poses), -1, 3)


def _filled(normal: FloatArray) -> FloatArray:
    """The identity where a matrix is not finite or nearly singular, so that one lost tag does not end the batch."""
    finite = np.asarray(np.isfinite(normal).all(axis=(1, 2)))
    tame = np.where(finite[:, None, None], normal, np.eye(3))
    good = finite & (np.asarray(np.linalg.cond(tame)) < _SINGULAR)
    return np.where(good[:, None, None], tame, np.eye(3))


def _mean_side(rays: FloatArray) -> FloatArray:
    sides: FloatArray = np.linalg.norm(np.roll(rays[:, :4], -1, axis=1) - rays[:, :4], axis=2).mean(axis=1)
    return sides
