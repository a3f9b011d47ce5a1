"""Outside-in: cameras over the waypoints look at the tag on the robot (paper, Sec. V)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from taskslam.geometry import SE2, FloatArray, wrap
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.fully_visible import MOST_RESIDUAL_PX, border_margin, why_cut
from taskslam.realworld.looks import Look
from taskslam.realworld.plane_calibration import PlaneCalibration, calibrate_plane
from taskslam.realworld.setup_file import OverheadCamera, RobotTag
from taskslam.realworld.sighting import Fault, NoSighting, Sighting, Station
from taskslam.realworld.tags.spatial_pose import both_poses, choose_pose
from taskslam.realworld.tags.tag_plane import PlanarFit, TagPlane, fit_in_plane, tag_square

LARGE_TAG_PX = 60.0
"""Side from which on a tag's heading is taken from its pose in space."""


def focal_length(camera: Camera) -> float:
    """One focal length, px, for both axes: their geometric mean."""
    return float(np.sqrt(camera.K[0, 0] * camera.K[1, 1]))


def overhead_station(
    source: OverheadCamera, camera: Camera, looks: Sequence[Look], tag: RobotTag, published: bool = False
) -> tuple[Station, PlaneCalibration | None]:
    """The floor frame of one camera, calibrated on the tag wherever it was wholly seen, and the poses in it.

    published: x, y and yaw of the tag in the camera's own frame instead, as the published evaluation has it (5.7); None
    is the plane then, and where the tag was never seen.
    """
    corners: dict[int, FloatArray] = {}
    refused: dict[int, NoSighting] = {}
    for row, look in enumerate(looks):
        found = _only_tag(look, camera, tag)
        if isinstance(found, NoSighting):
            refused[row] = found
        else:
            corners[row] = found
    focal = focal_length(camera)
    rays = {row: camera.undistort(at) for row, at in corners.items()}
    plane, fits = None, None
    place = {row: number for number, row in enumerate(rays)}
    if rays and not published:
        stack = np.array(list(rays.values()))
        plane = calibrate_plane(stack, tag.size, focal, from_above=True)
        fits = fit_in_plane(stack, tag_square(tag.size, from_above=True), plane.plane, focal)

    def measure(row: int) -> Sighting | NoSighting:
        if row in refused:
            return refused[row]
        margin = border_margin(corners[row], camera)
        if plane is None or fits is None:
            return _camera_frame(rays[row], tag, focal, margin)
        return _on_the_floor(fits, place[row], rays[row], tag, plane.plane, focal, margin)

    station = Station(
        name=f"camera {source.name}",
        goals=tuple(number - 1 for number in source.waypoints),
        looks=looks,
        camera=camera,
        clock=source.name,
        place=source.place.pose if source.place is not None else None,
        measure=measure,
    )
    return station, plane


def _only_tag(look: Look, camera: Camera, tag: RobotTag) -> FloatArray | NoSighting:
    """Corners of the robot's tag, if it is in the image once and wholly."""
    if look.problem is not None:
        return NoSighting(Fault.PROBLEM, f"the image could not be used ({look.problem})")
    if not look.tags:
        return NoSighting(Fault.NO_TAG, f"tag {tag.id} was not found")
    if len(look.tags) > 1:
        return NoSighting(Fault.TWICE, f"tag {tag.id} was found {len(look.tags)} times")
    cut = why_cut(look.tags[0].corners, camera, tag.family)
    return NoSighting(Fault.CUT, f"tag {tag.id} is {cut}") if cut else look.tags[0].corners


def _on_the_floor(
    fits: PlanarFit, row: int, rays: FloatArray, tag: RobotTag, plane: TagPlane, focal: float, margin: float
) -> Sighting | NoSighting:
    """Position by the known plane; so is the heading of a small tag, while a large one gives it better in space.

    A tilt of the robot turns the square that is fitted in the plane, by a few tenths of the tilt; in space it does not.
    """
    residual = float(fits.residual_px[row])
    if not residual < MOST_RESIDUAL_PX:
        return NoSighting(Fault.RESIDUAL, f"no square on the floor fits the tag's corners ({residual:.2f} px off)")
    x, y, theta = fits.poses[row].tolist()
    covariance, other = fits.covariances[row], None
    spatial = both_poses(rays, tag_square(tag.size, from_above=False), focal)
    if spatial:
        fit = choose_pose(spatial, -plane.up)
        along, across = plane.T_camera_plane[:3, :2].T @ fit.T_camera_target[:3, 0]
        other = float(np.arctan2(across, along))
        if fits.side_px[row] >= LARGE_TAG_PX:
            theta, other = other, theta
            covariance = covariance.copy()
            covariance[2, :2] = covariance[:2, 2] = 0.0
            covariance[2, 2] = plane.up @ fit.covariance[:3, :3] @ plane.up
    pose, covariance = moved_base(SE2(x, y, theta), covariance, tag.mount.pose)
    base_heading = None if other is None else float(wrap(other - tag.mount.pose.theta))
    return Sighting(pose, covariance, residual, margin, base_heading)


def moved_base(tag: SE2, covariance: FloatArray, mount: SE2) -> tuple[SE2, FloatArray]:
    """T_frame_base and its covariance from those of the tag: `T_frame_base = T_frame_tag @ T_base_tag^-1`."""
    base = tag @ mount.inverse()
    slope = np.eye(3)
    slope[:2, 2] = tag.y - base.y, base.x - tag.x
    return base, np.asarray(slope @ covariance @ slope.T)


def _camera_frame(rays: FloatArray, tag: RobotTag, focal: float, margin: float) -> Sighting | NoSighting:
    """The published way: translation and atan2(R10, R00) of the better pose in space, in the camera's frame."""
    fits = both_poses(rays, tag_square(tag.size, from_above=False), focal)
    if not fits:
        return NoSighting(Fault.RESIDUAL, "the tag's corners give no pose")
    T = fits[0].T_camera_target
    return Sighting(SE2.from_matrix(T), planar_block(fits[0].covariance), fits[0].residual_px, margin)


def planar_block(covariance: FloatArray) -> FloatArray:
    """(3, 3) of x, y and rotation about z, out of the (6, 6) of rotation and translation."""
    rows = [3, 4, 2]
    return covariance[np.ix_(rows, rows)]
