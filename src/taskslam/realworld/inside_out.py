"""Inside-out: a camera on the robot looks up at tags over the waypoints.

The pose is that of the robot in the frame of the tags, not that of the tags in the robot's: with a tag 0.6 m off the
optical axis, 5 degrees of heading from round to round would else pass for 3.8 cm of position (protocol 5.7). All tags
of a bundle give one pose together (PnP), so that the robot may tilt.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from taskslam.geometry import SE2, FloatArray, invert_se3
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.fully_visible import MOST_RESIDUAL_PX, border_margin, why_cut
from taskslam.realworld.looks import Look
from taskslam.realworld.outside_in import focal_length, moved_base, planar_block
from taskslam.realworld.setup_file import Bundle, BundleTag, CameraMount, UpwardCamera
from taskslam.realworld.sighting import Fault, NoSighting, Sighting, Station
from taskslam.realworld.tags.spatial_pose import SpatialFit, both_poses, choose_pose
from taskslam.realworld.tags.tag_plane import TagPlane, fit_in_plane

LEAST_TAGS = 2
"""Tags of a bundle that must be wholly in view: with one, a tilt of the robot cannot be told from a way driven."""

_UP = np.array([0.0, 0.0, 1.0])
_IMAGE_TOP = SE2(0.0, 0.0, -np.pi / 2)  # of a camera that looks up, in a plane's frame (x to the image's right)


def bundle_station(
    bundle: Bundle, goal: int, source: UpwardCamera, camera: Camera, looks: Sequence[Look], published: bool = False
) -> Station:
    """The tags over one goal, and the poses of the robot in their frame.

    looks: all of the camera. published: x, y and yaw of the first tag in the camera's frame, as published (5.7).
    """
    layout = {tag.id: tag for tag in bundle.layout}
    own = [
        Look(look.frame, tuple(tag for tag in look.tags if tag.id in layout), look.problem, look.others)
        for look in looks
    ]
    focal = focal_length(camera)
    height = _level_height(own, layout, camera, focal) if len(layout) == 1 else None

    def measure(row: int) -> Sighting | NoSighting:
        found = _whole_tags(own[row], layout, camera, bundle.family)
        if isinstance(found, NoSighting):
            return found
        points = np.concatenate([layout[i].corners for i in found])
        pixels = np.concatenate(list(found.values()))
        rays, margin = camera.undistort(pixels), border_margin(pixels, camera)
        if published:
            return _camera_frame(rays[:4], layout[next(iter(found))], focal, margin)
        if height is not None:
            return _level(rays, points, height, source.mount.pose, focal, margin)
        return _in_space(rays, points, source.mount, focal, margin)

    return Station(
        name=f"the tags over waypoint {goal + 1}",
        goals=(goal,),
        looks=own,
        camera=camera,
        clock=source.name,
        place=bundle.place.pose if bundle.place is not None else None,
        measure=measure,
    )


def _whole_tags(
    look: Look, layout: dict[int, BundleTag], camera: Camera, family: str
) -> dict[int, FloatArray] | NoSighting:
    """Corners by id of the bundle's tags that are wholly in the image, in the order of ids; or why they are too few."""
    if look.problem is not None:
        return NoSighting(Fault.PROBLEM, f"the image could not be used ({look.problem})")
    names = ", ".join(str(i) for i in layout)
    if not look.tags:
        return NoSighting(Fault.NO_TAG, f"none of the tags {names} was found")
    once = look.corners()
    twice = sorted({tag.id for tag in look.tags} - once.keys())
    if twice:
        return NoSighting(Fault.TWICE, f"tag {twice[0]} was found more than once")
    cut = {i: why_cut(corners, camera, family) for i, corners in once.items()}
    whole = {i: once[i] for i in sorted(once) if cut[i] is None}
    if len(whole) >= min(LEAST_TAGS, len(layout)):
        return whole
    also = "; ".join(f"tag {i} is {why}" for i, why in cut.items() if why)
    return NoSighting(
        Fault.CUT,
        f"{len(whole)} of the tags {names} wholly in view, {min(LEAST_TAGS, len(layout))} needed"
        + (f" ({also})" if also else ""),
    )


def _in_space(
    rays: FloatArray, points: FloatArray, mount: CameraMount, focal: float, margin: float
) -> Sighting | NoSighting:
    fits = both_poses(rays, points, focal)
    fit = choose_pose(fits, _UP) if fits else None
    if fit is None or not fit.residual_px < MOST_RESIDUAL_PX:
        off = f"{fit.residual_px:.2f} px off" if fit else "no pose at all"
        return NoSighting(Fault.RESIDUAL, f"the tags are not where the setup says ({off})")
    pose, covariance = base_under_tags(fit, mount.T_base_camera)
    return Sighting(pose, covariance, fit.residual_px, margin)


def base_under_tags(fit: SpatialFit, T_base_camera: FloatArray) -> tuple[SE2, FloatArray]:
    """Planar pose of the base in the tags' frame and its covariance (3, 3), from the pose of the tags in the camera.

    A small motion (w, v) of the tags in the optical frame moves the point r of the camera, seen from the tags, by
    -R^T (v + w x r), and turns it by -R^T w.
    """
    R = fit.T_camera_target[:3, :3]
    T_camera_base = invert_se3(T_base_camera)
    T = invert_se3(fit.T_camera_target) @ T_camera_base
    x, y, z = T_camera_base[:3, 3]
    lever = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])  # [r]x, so that w x r = -[r]x w
    motion = -R.T @ np.hstack([-lever, np.eye(3)])
    turn = -R.T @ np.hstack([np.eye(3), np.zeros((3, 3))])
    slope = np.vstack([motion[:2], turn[2]])
    return SE2.from_matrix(T), np.asarray(slope @ fit.covariance @ slope.T)


def _level_height(looks: Sequence[Look], layout: dict[int, BundleTag], camera: Camera, focal: float) -> float | None:
    """How high a single tag hangs above a level camera, m: the median over all looks; None if it was never seen."""
    (tag,) = layout.values()
    unit = TagPlane(_UP, 1.0)
    scales = [
        float(fit_in_plane(camera.undistort(at[tag.id])[None], tag.corners, unit, focal).scale[0])
        for at in (look.corners() for look in looks)
        if tag.id in at
    ]
    return 1.0 / float(np.median(scales)) if scales else None


def _level(
    rays: FloatArray, points: FloatArray, height: float, mount: SE2, focal: float, margin: float
) -> Sighting | NoSighting:
    """The pose by one tag, as if the camera were level: a tilt of 1 degree moves it by 1.7 % of the height."""
    fit = fit_in_plane(rays[None], points, TagPlane(_UP, height), focal)
    residual = float(fit.residual_px[0])
    if not np.isfinite(residual):
        return NoSighting(Fault.RESIDUAL, "the tag's corners fit no ceiling")
    T_plane_tag = SE2(*fit.poses[0].tolist())
    T_tag_camera = T_plane_tag.inverse() @ _IMAGE_TOP
    c, s = np.cos(T_plane_tag.theta), np.sin(T_plane_tag.theta)
    # p = -R^T t: its slopes by t are -R^T, and by theta the quarter turn of p, negative.
    slope = np.array([[-c, -s, T_tag_camera.y], [s, -c, -T_tag_camera.x], [0, 0, -1.0]])
    covariance = slope @ fit.covariances[0] @ slope.T
    pose, covariance = moved_base(T_tag_camera, covariance, mount)
    return Sighting(pose, covariance, residual, margin)


def _camera_frame(rays: FloatArray, tag: BundleTag, focal: float, margin: float) -> Sighting | NoSighting:
    """The published way: the tag's x, y in the camera's frame, its heading turned with the robot's."""
    fits = both_poses(rays, tag.corners - tag.corners.mean(axis=0), focal)
    if not fits:
        return NoSighting(Fault.RESIDUAL, "the tag's corners give no pose")
    T = fits[0].T_camera_target
    return Sighting(SE2.from_matrix(T), planar_block(fits[0].covariance), fits[0].residual_px, margin)
