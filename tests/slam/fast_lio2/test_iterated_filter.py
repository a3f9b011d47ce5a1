"""The gain against the textbook's, and the iteration against a minimiser that knows nothing of filters."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from taskslam.slam.fast_lio2.iterated_filter import Matching, step, update
from taskslam.slam.fast_lio2.planes import find_planes, residuals
from taskslam.slam.fast_lio2.state import DIMENSIONS, State, minus, plus
from taskslam.slam.fast_lio2.voxel_map import VoxelMap
from taskslam.slam.inertial.rotations import exp_so3

MEASURED = [0, 1, 2, 3, 4, 5, 15, 16, 17, 18, 19, 20]
POINT_COV = 1e-3


@pytest.fixture
def state() -> State:
    zero = np.zeros(3)
    g = np.array([0.2, -0.1, -9.8])
    return State(np.eye(3), zero, zero, zero, zero, exp_so3(np.array([0.0, 0.1, 0.0])), np.array([0.0, 0.0, 0.4]), g)


@pytest.fixture
def prior():
    A = np.random.default_rng(3).normal(size=(DIMENSIONS, DIMENSIONS))
    scale = np.repeat([0.02, 0.1, 0.1, 0.01, 0.03, 0.003, 0.003, 0.003], [3] * 7 + [2])
    return (A @ A.T / DIMENSIONS + 0.3 * np.eye(DIMENSIONS)) * np.outer(scale, scale)


def corner(dice, count, noise):
    """Points on a floor and two walls, all in the world's frame."""
    flat = dice.uniform(0.5, 4, (count, 3))
    flat[np.arange(count), np.arange(count) % 3] = 0.0
    points = flat - 2.0
    points[np.arange(count), np.arange(count) % 3] += noise * dice.normal(size=count)
    return points


def test_the_gain_equals_that_of_the_covariance_form(state, prior) -> None:
    """K = P H^T (H P H^T + R)^-1 at the prediction itself."""
    dice = np.random.default_rng(1)
    r, H = 0.05 * dice.normal(size=50), dice.normal(size=(50, 12))
    wide = np.zeros((50, DIMENSIONS))
    wide[:, MEASURED] = H
    K = prior @ wide.T @ np.linalg.inv(wide @ prior @ wide.T + POINT_COV * np.eye(50))
    d, after = step(state, prior, state, r, H, POINT_COV)
    np.testing.assert_allclose(d, -K @ r, atol=1e-9)
    np.testing.assert_allclose(after, (np.eye(DIMENSIONS) - K @ wide) @ prior, atol=1e-10)


@pytest.fixture
def corner_map():
    kept = VoxelMap(0.2, keep_nearest=False)
    kept.insert(corner(np.random.default_rng(0), 4000, 0.0))
    return kept


def looking_from(truth, points):
    return ((points - truth.p) @ truth.R - truth.p_il) @ truth.R_il


def test_the_iteration_ends_at_the_most_likely_state(state, prior, corner_map) -> None:
    """The minimum of the prior's and the points' squared errors, found by Levenberg and Marquardt."""
    moved = np.zeros(DIMENSIONS)
    moved[:6] = [0.03, -0.02, 0.05, 0.1, -0.08, 0.06]
    points = looking_from(plus(state, moved), corner(np.random.default_rng(9), 300, 0.005))
    matching = Matching(5, 1.0, 0.1, 0.9, POINT_COV, 1e-9, 15, True, True)
    found = update(state, prior, points, corner_map.keys, corner_map.points, corner_map.size, matching)
    planes = find_planes(corner_map.keys, corner_map.points, corner_map.size, points, found.x, 5, 1.0, 0.1)
    _, chosen = residuals(points, planes, found.x, 0.9, True)
    assert len(chosen) == found.matched > 250
    root = np.linalg.inv(np.linalg.cholesky(prior))
    fits = np.array([len(residuals(points[n : n + 1], planes[n : n + 1], found.x, 0.9, True)[0]) for n in range(300)])

    def cost(d):
        x = plus(state, d)
        r, _ = residuals(points[fits > 0], planes[fits > 0], x, 0.0, True)
        return np.concatenate([root @ d, r / np.sqrt(POINT_COV)])

    best = least_squares(cost, np.zeros(DIMENSIONS), method="lm", xtol=1e-14, ftol=1e-14, gtol=1e-14)
    np.testing.assert_allclose(minus(found.x, state), best.x, atol=2e-6)
    np.testing.assert_allclose(minus(found.x, state)[:6], moved[:6], atol=0.02)


def test_an_update_never_makes_less_sure(state, prior, corner_map) -> None:
    points = looking_from(state, corner(np.random.default_rng(9), 300, 0.005))
    matching = Matching(5, 1.0, 0.1, 0.9, POINT_COV, 1e-3, 3, False, True)
    found = update(state, prior, points, corner_map.keys, corner_map.points, corner_map.size, matching)
    assert np.linalg.eigvalsh(prior - found.P).min() > -1e-9
    np.testing.assert_allclose(found.P, found.P.T, atol=0)
    assert np.linalg.eigvalsh(found.P).min() > 0


def test_points_far_from_the_map_leave_the_prediction(state, prior, corner_map) -> None:
    matching = Matching(5, 1.0, 0.1, 0.9, POINT_COV, 1e-3, 3, False, True)
    points = np.random.default_rng(0).uniform(20, 30, (100, 3))
    found = update(state, prior, points, corner_map.keys, corner_map.points, corner_map.size, matching)
    assert found.matched == 0
    for one, two in zip(found.x, state, strict=True):
        np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(found.P, prior)


def stairs(dice, count, noise):
    """Steps of 0.4 m in three directions, on which the nearest surface is soon another one."""
    points = dice.uniform(-2, 2, (count, 3))
    axis = np.arange(count) % 3
    beside = np.floor(points[np.arange(count), (axis + 1) % 3] / 0.4)
    points[np.arange(count), axis] = -2.0 + 0.4 * np.mod(beside, 2) + noise * dice.normal(size=count)
    return points


def test_new_neighbours_take_it_where_the_old_ones_do_not(state, prior) -> None:
    """A prediction that is up to 15 cm off: some of the planes found from there are others' than the points'."""
    kept = VoxelMap(0.1, keep_nearest=False)
    kept.insert(stairs(np.random.default_rng(0), 30_000, 0.0))
    errors = {True: [], False: []}
    for seed in range(20):
        dice = np.random.default_rng(seed)
        moved = np.zeros(DIMENSIONS)
        moved[3:6] = dice.uniform(-0.15, 0.15, 3)
        points = looking_from(plus(state, moved), stairs(dice, 300, 0.005))
        for refresh, found in errors.items():
            matching = Matching(5, 1.0, 0.1, 0.9, POINT_COV, 1e-3, 5, False, refresh)
            after = update(state, prior, points, kept.keys, kept.points, kept.size, matching)
            found.append(np.linalg.norm(minus(after.x, state)[3:6] - moved[3:6]))
    assert np.mean(errors[True]) < 0.7 * np.mean(errors[False])
