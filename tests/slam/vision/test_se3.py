import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from taskslam.slam.inertial.rotations import exp_so3, hat, log_so3
from taskslam.slam.vision.cholesky import solve_positive
from taskslam.slam.vision.se3 import adjoint, exp_se3

numbers = st.floats(-1.5, 1.5)
twists = st.tuples(*[numbers] * 6).map(np.array)


def twist_matrix(xi):
    M = np.zeros((4, 4))
    M[:3, :3], M[:3, 3] = hat(xi[3:]), xi[:3]
    return M


@given(twists)
def test_the_exponential_is_that_of_the_matrix(xi):
    np.testing.assert_allclose(exp_se3(xi), expm(twist_matrix(xi)), atol=1e-12)


@given(st.tuples(*[numbers] * 3).map(np.array))
def test_the_logarithm_gives_the_rotation_vector_back(w):
    np.testing.assert_allclose(log_so3(exp_so3(w)), w, atol=1e-9)


@given(twists, twists)
def test_the_adjoint_moves_a_twist_to_the_other_side(xi, eta):
    T = exp_se3(eta)
    np.testing.assert_allclose(T @ exp_se3(xi), exp_se3(adjoint(T) @ xi) @ T, atol=1e-11)


def test_a_positive_system_is_solved_and_another_is_refused():
    random = np.random.default_rng(1)
    half = random.normal(size=(9, 9))
    A, b = half @ half.T + np.eye(9), random.normal(size=9)
    x, solved = solve_positive(A, b)
    assert solved
    np.testing.assert_allclose(x, np.linalg.solve(A, b), atol=1e-12)
    assert not solve_positive(np.diag([1.0, -1.0]), np.ones(2))[1]
    assert not solve_positive(np.full((2, 2), np.nan), np.ones(2))[1]


@pytest.mark.parametrize("scale", [1e-12, 1e-8, 1e-6])
def test_tiny_rotations_keep_their_size(scale):
    w = scale * np.array([1.0, -2.0, 0.5])
    np.testing.assert_allclose(log_so3(exp_so3(w)), w, rtol=1e-6)
