"""Pose of a stereo camera: its Jacobians against differences, and what it makes of wrong matches."""

import numpy as np
import pytest
from stereo_scene import PINHOLE, points, pose, see

from taskslam.slam.bundle.stereo_pose import fits_pose, solve_stereo_pose
from taskslam.slam.bundle.stereo_residuals import reproject
from taskslam.slam.bundle.three_point_pose import align_triads, draw_pose
from taskslam.slam.vision.se3 import exp_se3


@pytest.fixture
def random():
    return np.random.default_rng(3)


def residuals(T, X, seen):
    r, J, P = np.zeros(3), np.zeros((3, 6)), np.zeros((3, 3))
    rows = reproject(T, X, seen, PINHOLE, r, J, P)
    return rows, r, J, P @ T[:3, :3]


def test_jacobians_are_what_differences_say(random):
    T, step = pose(random, 0.3, 0.2), 1e-6
    for X in points(random, 20):
        seen = see(T, X[None])[0]
        rows, _, J, L = residuals(T, X, seen)
        assert rows == 3
        for axis in range(6):
            xi = np.zeros(6)
            xi[axis] = step
            ahead, back = (residuals(exp_se3(sign * xi) @ T, X, seen)[1] for sign in (1.0, -1.0))
            np.testing.assert_allclose(J[:, axis], (back - ahead) / (2 * step), rtol=1e-4, atol=1e-4)
        for axis in range(3):
            dX = np.zeros(3)
            dX[axis] = step
            ahead, back = (residuals(T, X + sign * dX, seen)[1] for sign in (1.0, -1.0))
            np.testing.assert_allclose(L[:, axis], (back - ahead) / (2 * step), rtol=1e-4, atol=1e-4)


def test_a_point_behind_the_camera_counts_nothing():
    assert residuals(np.eye(4), np.array([0.0, 0.0, -1.0]), np.zeros(3))[0] == 0


def test_without_a_disparity_two_rows_are_left():
    rows, r, *_ = residuals(np.eye(4), np.array([0.1, 0.2, 2.0]), np.array([394.0, 276.0, np.nan]))
    assert rows == 2
    np.testing.assert_allclose(r[:2], 0.0, atol=1e-12)


def test_the_pose_is_found_among_wrong_matches(random):
    T, places = pose(random, 0.3, 0.1), points(random, 200)
    seen = see(T, places)
    seen[::3, 2] = np.nan
    wrong = np.arange(200) % 4 == 0
    seen[wrong, :2] += random.uniform(15, 40, (wrong.sum(), 2))
    found, fits, information = solve_stereo_pose(pose(random, 0.05, 0.02) @ T, places, seen, np.ones(200), PINHOLE)
    np.testing.assert_allclose(found, T, atol=1e-6)
    np.testing.assert_array_equal(fits, ~wrong)
    assert np.linalg.eigvalsh(information).min() > 0
    np.testing.assert_array_equal(fits_pose(T, places, seen, np.ones(200), PINHOLE), ~wrong)


def test_too_few_points_determine_nothing(random):
    places = points(random, 5)
    _, fits, _ = solve_stereo_pose(np.eye(4), places, see(np.eye(4), places), np.ones(5), PINHOLE)
    assert not fits.any()


def test_the_covariance_is_that_of_the_errors(random):
    """The information that is returned predicts the scatter of the poses that noise of one pixel leads to."""
    places = points(random, 120)
    clean, errors = see(np.eye(4), places), []
    for _ in range(300):
        noisy = clean + random.normal(0, 1.0, clean.shape)
        found, _, information = solve_stereo_pose(np.eye(4), places, noisy, np.ones(120), PINHOLE)
        errors.append(found[:3, 3])
    expected = np.sqrt(np.diag(np.linalg.inv(information))[:3])
    np.testing.assert_allclose(np.std(errors, axis=0), expected, rtol=0.25)


def test_three_points_give_the_pose(random):
    T, places = pose(random, 1.0, 1.0), points(random, 3)
    found, solved = align_triads(places, places @ T[:3, :3].T + T[:3, 3])
    assert solved
    np.testing.assert_allclose(found, T, atol=1e-9)


def test_three_points_on_a_line_do_not():
    line = np.arange(9.0).reshape(3, 3)
    assert not align_triads(line, line)[1]


def test_a_pose_is_drawn_where_most_matches_are_wrong(random):
    T, places = pose(random, 2.0, 1.0), points(random, 150)
    in_view = places @ T[:3, :3] - T[:3, 3] @ T[:3, :3]  # so that T sees them before it
    seen = see(T, in_view)
    wrong = np.arange(150) % 5 > 1
    seen[wrong] = random.permutation(seen[wrong]) + 25.0
    found, fits = draw_pose(in_view, seen, np.ones(150), PINHOLE, 300, 0)
    np.testing.assert_allclose(found, T, atol=1e-6)
    np.testing.assert_array_equal(fits, ~wrong)
    again, _ = draw_pose(in_view, seen, np.ones(150), PINHOLE, 300, 0)
    assert again.tobytes() == found.tobytes()
