"""The manifold and its derivatives, and the covariance carried by the IMU."""

import numpy as np
import pytest

from taskslam.slam.fast_lio2.state import (
    DIMENSIONS,
    carried,
    minus,
    minus_jacobian,
    plus,
    tangent_of_gravity,
)


def errors(scale):
    return scale * np.random.default_rng(7).normal(size=(20, DIMENSIONS))


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 0.3])
def test_minus_undoes_plus(state, scale) -> None:
    for d in errors(scale):
        np.testing.assert_allclose(minus(plus(state, d), state), d, atol=1e-9)
        assert np.linalg.norm(plus(state, d).g) == pytest.approx(np.linalg.norm(state.g))


@pytest.mark.parametrize("g", [[0, 0, -9.8], [0, 0, 9.8], [9.8, 0, 0], [3, -2, 5]])
def test_the_tangent_lies_across_gravity(g) -> None:
    g = np.array(g, float)
    B = tangent_of_gravity(g)
    np.testing.assert_allclose(B.T @ B, np.eye(2), atol=1e-14)
    np.testing.assert_allclose(B.T @ g, 0, atol=1e-14)


@pytest.mark.parametrize("scale", [0.0, 1e-3, 0.2])
def test_the_derivative_of_minus_equals_numerical_differences(state, scale) -> None:
    for d in errors(scale)[:4]:
        x, step = plus(state, d), 1e-6
        numerical = [
            (minus(plus(x, step * e), state) - minus(plus(x, -step * e), state)) / (2 * step)
            for e in np.eye(DIMENSIONS)
        ]
        np.testing.assert_allclose(minus_jacobian(x, state), np.stack(numerical, axis=1), atol=1e-7)


def test_the_covariance_is_carried_as_the_errors_are(state) -> None:
    """Along every direction: the state carried from a neighbour differs as F says."""
    pieces = np.full(3, 0.01), np.full((3, 3), 0.4), np.tile([0.3, -0.2, 9.9], (3, 1)), np.zeros((3, 4))
    step = 1e-5
    plain = carried(state, np.zeros((DIMENSIONS, DIMENSIONS)), *pieces)[0]
    for direction in np.eye(DIMENSIONS):
        there = minus(carried(plus(state, step * direction), np.zeros((DIMENSIONS,) * 2), *pieces)[0], plain)
        back = minus(carried(plus(state, -step * direction), np.zeros((DIMENSIONS,) * 2), *pieces)[0], plain)
        derivative = (there - back) / (2 * step)
        P = carried(state, np.outer(direction, direction), *pieces)[1]
        np.testing.assert_allclose(P, np.outer(derivative, derivative), atol=3e-3 if direction[9:12].any() else 1e-6)


def test_a_piece_without_readings_goes_on_as_it_went(state) -> None:
    nothing = np.full((1, 3), np.nan)
    x, _, track = carried(state, np.eye(DIMENSIONS), np.array([0.5]), nothing, nothing, np.zeros((1, 4)))
    np.testing.assert_allclose(x.R, state.R, atol=1e-15)
    np.testing.assert_allclose(x.v, state.v, atol=1e-12)
    np.testing.assert_allclose(x.p, state.p + 0.5 * state.v, atol=1e-12)
    np.testing.assert_array_equal(track.times, [-0.5])
