import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskslam.geometry import rotation_from_rpy, wrap
from taskslam.realworld.tags.tag_plane import TagPlane, fit_in_plane, tag_square

FOCAL = 800.0
SIZE = 0.19


def rays_of(plane: TagPlane, poses: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N, P, 2) exact normalised rays to points of rigid sets at poses (N, 3) in the plane."""
    T = plane.T_camera_plane
    c, s = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
    x = poses[:, 0, None] + c * points[:, 0] - s * points[:, 1]
    y = poses[:, 1, None] + s * points[:, 0] + c * points[:, 1]
    at = np.stack([x, y, np.zeros_like(x), np.ones_like(x)], axis=-1) @ T.T
    return at[..., :2] / at[..., 2:3]


def plane_at(tilt: float, direction: float, height: float) -> TagPlane:
    """Seen from above for a negative height. tilt, direction: rad."""
    nominal = np.array([0.0, 0.0, math.copysign(1.0, height)])
    turned = rotation_from_rpy(0, 0, direction) @ rotation_from_rpy(tilt, 0, 0) @ nominal
    return TagPlane(turned, height)


@settings(deadline=None, max_examples=60)
@given(
    tilt=st.floats(0, 0.7),
    direction=st.floats(-3, 3),
    height=st.sampled_from([-2.5, -0.8, 1.5, 3.0]),
    theta=st.floats(-3.1, 3.1),
    off=st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2)),
)
def test_exact_corners_give_the_exact_pose_whatever_the_tilt(tilt, direction, height, theta, off):
    plane = plane_at(tilt, direction, height)
    middle = plane.meet(np.array([off]))[0]
    pose = np.array([[*middle, theta]])
    square = tag_square(SIZE, plane.from_above)
    fit = fit_in_plane(rays_of(plane, pose, square), square, plane, FOCAL)
    assert np.abs(fit.poses[0, :2] - pose[0, :2]).max() < 1e-9
    assert abs(wrap(fit.poses[0, 2] - theta)) < 1e-9
    assert fit.residual_px[0] < 1e-6
    assert fit.scale[0] == pytest.approx(1, abs=1e-9)


def test_the_covariance_is_that_of_the_errors_which_noisy_corners_make():
    rng = np.random.default_rng(1)
    plane = plane_at(0.5, 0.3, -2.5)
    square = tag_square(SIZE, True)
    poses = np.column_stack([plane.meet(rng.uniform(-0.4, 0.4, (2000, 2))), rng.uniform(-3, 3, 2000)])
    rays = rays_of(plane, poses, square) + rng.normal(0, 0.2 / FOCAL, (2000, 4, 2))
    fit = fit_in_plane(rays, square, plane, FOCAL)
    errors = fit.poses - poses
    errors[:, 2] = wrap(errors[:, 2])
    for axis in range(3):
        assert errors[:, axis].std() == pytest.approx(math.sqrt(fit.covariances[:, axis, axis].mean()), rel=0.1)


def test_a_tag_that_the_plane_cannot_hold_costs_itself_alone():
    plane = plane_at(1.2, 0.0, -2.5)
    square = tag_square(SIZE, True)
    pose = np.array([[*plane.meet(np.zeros((1, 2)))[0], 0.3]])
    true = rays_of(plane, pose, square)
    away = true + 30 * plane.up[:2] / np.linalg.norm(plane.up[:2])  # above the horizon: no ray meets the floor
    fit = fit_in_plane(np.concatenate([true, away, np.full((1, 4, 2), np.nan)]), square, plane, FOCAL)
    assert fit.residual_px[0] < 1e-6
    assert np.isnan(fit.poses[1:]).all()
    assert np.isnan(fit.covariances[1:]).all()


def test_a_tag_seen_from_above_turns_left_when_the_robot_does():
    """Anticlockwise from above is clockwise for a camera below: the sign is the plane's affair, not the user's."""
    for height in (-2.0, 2.0):
        plane = plane_at(0.0, 0.0, height)
        square = tag_square(SIZE, plane.from_above)
        poses = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.2]])
        first, second = rays_of(plane, poses, square)
        top = [corners[:2].mean(axis=0) for corners in (first, second)]
        turn = float(
            top[0][0] * top[1][1] - top[0][1] * top[1][0]
        )  # positive: clockwise on the screen, where y points down
        assert (turn < 0) == (height < 0)
