"""The plane from the tags that were seen in it: no target, no tape measure, no level floor is needed.

All tags of one recording lie in one plane, so its two tilts and its height follow from the reprojection error of all
their corners, each tag's own pose in the plane being solved for inside (variable projection). One tag is enough to
begin with; many, spread over the image, average the robot's own wobble away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from taskslam.errors import InputError
from taskslam.geometry import FloatArray
from taskslam.realworld.fully_visible import MOST_RESIDUAL_PX
from taskslam.realworld.tags.spatial_pose import both_poses
from taskslam.realworld.tags.tag_plane import CORNER_NOISE_PX, PlanarFit, TagPlane, fit_in_plane, tag_square

ENOUGH_PLACES = 10
"""Places at which a tag must have been seen for a plane to be trusted without a word."""

_MOST_IN_A_PLACE = 4
_MOST = 400
_STARTS = 12
_ROUNDS = 3
_OUTLIER = 4.0


@dataclass(frozen=True, eq=False)
class PlaneCalibration:
    """plane, and how sure it is. sd_tilt: rad, the larger of the two tilts'. sd_height: m. residual_px: as `PlanarFit`.

    places: tag positions more than half a tag apart that it rests on. tags: how many sightings were used.
    """

    plane: TagPlane
    sd_tilt: float
    sd_height: float
    residual_px: float
    places: int
    tags: int

    @property
    def well_spread(self) -> bool:
        """Whether the tags were seen at enough places."""
        return self.places >= ENOUGH_PLACES


def calibrate_plane(rays: FloatArray, size: float, focal: float, from_above: bool) -> PlaneCalibration:
    """The plane of N sightings of one tag, or of tags of one size in one plane.

    rays: (N, 4, 2) normalised corner rays TL, TR, BR, BL. size: side of the tag, m. focal: px.

    Raises:
        InputError: no sighting, or none that a tag in front of the camera could give.
    """
    if len(rays) == 0:
        raise InputError("no sighting of the tag; expected at least one to find the plane in which it moves")
    square = tag_square(size, from_above)
    start = _start(rays, size, focal, from_above)
    fit = fit_in_plane(rays, square, start, focal)
    good = rays[np.nan_to_num(fit.residual_px, nan=np.inf) <= _outlier_px(fit)]
    for _ in range(_ROUNDS):
        found = _adjusted(good, start, size, focal)
        fit = fit_in_plane(good, square, found.plane, focal)
        kept = fit.residual_px <= _outlier_px(fit)
        if kept.all():
            break
        start, good = found.plane, good[kept]
    return found


def _outlier_px(fit: PlanarFit) -> float:
    """Above this residual a sighting is a blurred or cut tag, and no part of the plane."""
    return max(MOST_RESIDUAL_PX, _OUTLIER * float(np.nanmedian(fit.residual_px)))


def _adjusted(rays: FloatArray, start: TagPlane, size: float, focal: float) -> PlaneCalibration:
    """Least squares over the plane from one near by, with sightings from all places alike."""
    square = tag_square(size, start.from_above)
    chosen, places = _spread(fit_in_plane(rays, square, start, focal), size)
    used = rays[chosen]

    def residuals(unknown: FloatArray) -> FloatArray:
        errors = fit_in_plane(used, square, _moved(start, unknown), focal).errors.ravel()
        return np.where(np.isfinite(errors), errors, 1e3)

    found = least_squares(residuals, np.zeros(3), loss="soft_l1", f_scale=1.0, x_scale=[0.01, 0.01, 0.01])
    plane = _moved(start, found.x)
    errors = fit_in_plane(used, square, plane, focal).errors
    freedom = max(errors.size - 3 * len(used) - 3, 1)
    noise = max(float(np.sqrt((errors**2).sum() / freedom)), CORNER_NOISE_PX)
    slopes = np.asarray(found.jac, np.float64)
    covariance = np.linalg.pinv(slopes.T @ slopes) * noise**2
    tilt_a, tilt_b, height = np.sqrt(np.diag(covariance)).tolist()
    residual_px = float(np.sqrt((errors**2).sum(axis=(1, 2)).mean() / 4))
    return PlaneCalibration(plane, max(tilt_a, tilt_b), height * abs(start.height), residual_px, places, len(used))


def _start(rays: FloatArray, size: float, focal: float, from_above: bool) -> TagPlane:
    """The best plane among those in which single large tags may lie, both IPPE poses of each, judged by all tags."""
    sides = np.linalg.norm(np.roll(rays, -1, axis=1) - rays, axis=2).mean(axis=1)
    away = tag_square(size, from_above=False)
    candidates = []
    for row in np.argsort(-sides, kind="stable")[:: max(1, len(rays) // _STARTS)][:_STARTS]:
        for pose in both_poses(rays[row], away, focal):
            normal, at = pose.T_camera_target[:3, 2], pose.T_camera_target[:3, 3]
            up = -normal if from_above else normal
            candidates.append(TagPlane(up, float(at @ up)))
    square = tag_square(size, from_above)
    sample = rays[:: max(1, len(rays) // 50)]

    def cost(plane: TagPlane) -> float:
        # The median, so that a wrong detection among many has no say.
        missed = fit_in_plane(sample, square, plane, focal).residual_px
        return float(np.median(np.where(np.isfinite(missed), missed, np.inf)))

    candidates = [plane for plane in candidates if plane.from_above == from_above]
    if not candidates:
        side = "above" if from_above else "below"
        raise InputError(f"the tag's corners fit no plane seen from {side}; expected a tag in front of the camera")
    return min(candidates, key=cost)


def _moved(plane: TagPlane, unknown: FloatArray) -> TagPlane:
    """A plane turned by two angles (rad) about the axes in it, and its height scaled by exp(third)."""
    T = plane.T_camera_plane
    turn = Rotation.from_rotvec(T[:3, 0] * unknown[0] + T[:3, 1] * unknown[1])
    return TagPlane(np.asarray(turn.apply(plane.up)), plane.height * float(np.exp(unknown[2])))


def _spread(fit: PlanarFit, size: float) -> tuple[list[int], int]:
    """Rows to use, a few from each place so that a robot at rest does not outvote one on its way; number of places."""
    cells: dict[tuple[int, int], list[int]] = {}
    for row, (x, y, _) in enumerate(fit.poses.tolist()):
        if np.isfinite(x) and np.isfinite(y):
            cells.setdefault((int(np.floor(2 * x / size)), int(np.floor(2 * y / size))), []).append(row)
    rows = [
        row
        for members in cells.values()
        for row in members[:: max(1, -(-len(members) // _MOST_IN_A_PLACE))][:_MOST_IN_A_PLACE]
    ]
    return sorted(rows)[:: max(1, -(-len(rows) // _MOST))], len(cells)
