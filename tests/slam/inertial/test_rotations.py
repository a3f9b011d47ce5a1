"""SO(3) against gtsam, which implements it independently."""

import gtsam
import numpy as np
import pytest

from taskslam.slam.inertial.rotations import (
    exp_so3,
    hat,
    inverse_right_jacobian,
    log_so3,
    right_jacobian,
    rotate,
)

AXES = [np.array(axis) / np.linalg.norm(axis) for axis in ([1, 0, 0], [0, -1, 0], [1, 2, -3], [-0.1, 0.2, 0.9])]
ANGLES = [0.0, 1e-12, 1e-7, 9e-4, 1.1e-3, 0.1, 1.0, 2.5, 3.1, np.pi - 1e-5]


@pytest.fixture(params=ANGLES, ids=lambda angle: f"{angle:.3g}")
def vectors(request):
    return [request.param * axis for axis in AXES]


def test_exponential_equals_gtsams(vectors) -> None:
    for v in vectors:
        np.testing.assert_allclose(exp_so3(v), gtsam.Rot3.Expmap(v).matrix(), atol=2e-15)


def test_logarithm_undoes_the_exponential(vectors) -> None:
    for v in vectors:
        np.testing.assert_allclose(log_so3(exp_so3(v)), v, atol=3e-10)


def test_logarithm_of_half_a_turn_is_one_of_the_two() -> None:
    for axis in AXES:
        for angle in (np.pi, np.pi - 1e-7, np.pi - 1e-9):
            v = log_so3(exp_so3(angle * axis))
            assert abs(np.linalg.norm(v) - angle) < 1e-7
            np.testing.assert_allclose(exp_so3(v), exp_so3(angle * axis), atol=1e-9)


def test_right_jacobian_is_the_derivative_of_the_exponential(vectors) -> None:
    for v in vectors:
        step = 1e-6
        for k in range(3):
            d = np.zeros(3)
            d[k] = step
            moved = (log_so3(exp_so3(v).T @ exp_so3(v + d)) - log_so3(exp_so3(v).T @ exp_so3(v - d))) / (2 * step)
            np.testing.assert_allclose(right_jacobian(v)[:, k], moved, atol=1e-8)


def test_inverse_right_jacobian_is_the_inverse(vectors) -> None:
    for v in vectors:
        np.testing.assert_allclose(inverse_right_jacobian(v) @ right_jacobian(v), np.eye(3), atol=1e-9)


def test_hat_is_the_cross_product_and_rotate_the_product() -> None:
    v, w, R = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.7, -1.1]), exp_so3(np.array([0.4, -0.2, 1.0]))
    np.testing.assert_array_equal(hat(v) @ w, np.cross(v, w))
    np.testing.assert_allclose(rotate(R, *w), R @ w, atol=1e-15)
