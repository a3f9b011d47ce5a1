"""Observations of a rectified pair: derivatives, the null space and triangulation."""

import numpy as np
import pytest

from taskslam.slam.inertial.rotations import exp_so3
from taskslam.slam.msckf.observation import derivatives, project_out, seen_from, triangulate

BASELINE = 0.11


@pytest.fixture
def poses():
    """Six poses along a bend, cameras that look along z."""
    turns = np.linspace(0, 0.4, 6)
    return (
        np.array([exp_so3(np.array([0.1, turn, -0.05])) for turn in turns]),
        np.array([[0.3 * turn, 0.1 * turn, 0.8 * turn] for turn in turns]),
    )


def test_the_derivatives_equal_numerical_differences(poses) -> None:
    R, p, landmark = poses[0][3], poses[1][3], np.array([0.7, -0.4, 3.0])
    by_pose, by_landmark = derivatives(R, p, landmark, BASELINE)
    step = 1e-6
    for k in range(3):
        d = step * np.eye(3)[k]
        turned = seen_from(R @ exp_so3(d), p, landmark, BASELINE) - seen_from(R @ exp_so3(-d), p, landmark, BASELINE)
        moved = seen_from(R, p + d, landmark, BASELINE) - seen_from(R, p - d, landmark, BASELINE)
        shifted = seen_from(R, p, landmark + d, BASELINE) - seen_from(R, p, landmark - d, BASELINE)
        np.testing.assert_allclose(by_pose[:, k], turned / (2 * step), atol=1e-8)
        np.testing.assert_allclose(by_pose[:, 3 + k], moved / (2 * step), atol=1e-8)
        np.testing.assert_allclose(by_landmark[:, k], shifted / (2 * step), atol=1e-8)


def test_a_landmark_behind_is_not_seen() -> None:
    assert np.isnan(seen_from(np.eye(3), np.zeros(3), np.array([0.0, 0.0, -1.0]), BASELINE)).all()


def test_what_is_projected_out_is_what_the_singular_vectors_leave() -> None:
    """The rows left are an orthogonal basis of the left null space times H, r: the same H^T H, H^T r and r^T r."""
    dice = np.random.default_rng(0)
    H_f, H, r = dice.normal(size=(18, 3)), dice.normal(size=(18, 36)), dice.normal(size=18)
    null = np.linalg.svd(H_f)[0][:, 3:]
    turned_f, turned, left = H_f.copy(), H.copy(), r.copy()
    project_out(turned_f, turned, left)
    np.testing.assert_allclose(turned_f[3:], 0.0, atol=1e-12)
    np.testing.assert_allclose(turned[3:].T @ turned[3:], H.T @ null @ null.T @ H, atol=1e-10)
    np.testing.assert_allclose(turned[3:].T @ left[3:], H.T @ null @ null.T @ r, atol=1e-10)
    np.testing.assert_allclose(left[3:] @ left[3:], r @ null @ null.T @ r, atol=1e-10)


@pytest.mark.parametrize("depth", [0.8, 3.0, 12.0])
def test_a_landmark_is_found_where_it_is(poses, depth) -> None:
    landmark = np.array([0.2 * depth, -0.1 * depth, depth])
    seen = np.array([seen_from(R, p, landmark, BASELINE) for R, p in zip(*poses, strict=True)])
    found, good = triangulate(*poses, seen, BASELINE)
    assert good
    np.testing.assert_allclose(found, landmark, atol=1e-6 * depth**2)
    noisy = seen + 0.001 * np.random.default_rng(1).normal(size=seen.shape)
    found, good = triangulate(*poses, noisy, BASELINE)
    assert good
    assert np.linalg.norm(found - landmark) < 0.02 * depth**2


def test_no_disparity_is_no_landmark(poses) -> None:
    seen = np.array([seen_from(R, p, np.array([0.0, 0.0, 1e5]), BASELINE) for R, p in zip(*poses, strict=True)])
    assert not triangulate(*poses, seen, BASELINE)[1]
