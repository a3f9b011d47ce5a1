import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.navigation.band import initial_band, warm_start
from taskslam.navigation.settings import TebSettings
from taskslam.navigation.teb_problem import BAND, TebParameters
from taskslam.navigation.teb_solver import associate, optimize, resize, solve_banded

SETTINGS = TebSettings()
PARAMETERS = TebParameters.of(SETTINGS)
NOTHING = np.empty((0, 2))


def band_along(path, start=0.0, goal=0.0):
    return initial_band(np.array(path, float), start, goal, 0.3, 1.5, 0.3, SETTINGS.max_samples + 2)


def velocities(z, n):
    d = np.diff(z[:n, :3], axis=0)
    turn = np.arctan2(np.sin(d[:, 2]), np.cos(d[:, 2]))
    middle = z[: n - 1, 2] + 0.5 * turn
    dt = z[: n - 1, 3]
    lon = np.cos(middle) * d[:, 0] + np.sin(middle) * d[:, 1]
    lat = np.cos(middle) * d[:, 1] - np.sin(middle) * d[:, 0]
    return lon / dt, turn / dt, lat


def solve(path, start=0.0, goal=0.0, v=0.0, w=0.0, obstacles=NOTHING, repeat=1):
    z, n = band_along(path, start, goal)
    for _ in range(repeat):
        n, motion, obstacle = optimize(z, n, v, w, obstacles, PARAMETERS)
    return z, n, motion, obstacle


def test_the_banded_solver_agrees_with_a_dense_one():
    random = np.random.default_rng(0)
    size = 40
    dense = np.zeros((size, size))
    for i in range(size):
        for k in range(min(BAND, i + 1)):
            dense[i, i - k] = dense[i - k, i] = random.normal()
    dense += 12 * np.eye(size)
    H = np.zeros((size, BAND))
    for i in range(size):
        for k in range(min(BAND, i + 1)):
            H[i, k] = dense[i, i - k]
    g = random.normal(size=size)
    L, step = np.zeros_like(H), np.zeros(size)
    assert solve_banded(H, g, 3, size - 4, 0.7, L, step)
    inner = slice(3, size - 4)
    wanted = np.linalg.solve(dense[inner, inner] + 0.7 * np.eye(size - 7), -g[inner])
    np.testing.assert_allclose(step[inner], wanted, rtol=1e-9)
    assert not solve_banded(-H, g, 3, size - 4, 0.0, L, step)


def test_a_straight_band_drives_at_the_speed_limit_and_stops():
    z, n, *_ = solve([(0, 0), (2, 0)], repeat=5)
    v, w, lat = velocities(z, n)
    assert np.abs(w).max() < 1e-3
    assert np.abs(lat).max() < 1e-4
    assert 0.27 < np.median(v) < 0.36  # penalties are soft: the command is clipped at 0.3 afterwards
    assert v[0] < np.median(v) - 0.03
    assert v[-1] < np.median(v) - 0.03
    assert 2 / 0.36 < z[: n - 1, 3].sum() < 2 / 0.25


def test_a_bend_respects_the_kinematics():
    z, n, *_ = solve([(0, 0), (1, 0), (1, 1)], goal=math.pi / 2, repeat=5)
    v, w, lat = velocities(z, n)
    assert np.abs(lat).max() < 5e-3
    assert v.min() > -0.02
    assert np.abs(w).max() < 1.6


def test_with_the_goal_behind_it_turns_first():
    z, n, *_ = solve([(0, 0), (-2, 0)], goal=math.pi, repeat=5)
    v, _, lat = velocities(z, n)
    assert v.min() > -0.1
    assert np.abs(lat).max() < 0.02
    assert abs(z[:n, 1]).max() < 0.6


def test_a_turn_on_the_spot_stays_on_the_spot():
    z, n, *_ = solve([(0, 0), (0.01, 0)], goal=2.0, repeat=3)
    _, w, _ = velocities(z, n)
    assert np.hypot(*z[:n, :2].T).max() < 0.06
    assert w.max() > 0.6
    assert w.min() > -0.05


def test_a_band_keeps_clear_of_a_post():
    post = np.array([[1.0, 0.08]])
    z, n, *_ = solve([(0, 0), (2, 0)], obstacles=post, repeat=5)
    assert np.hypot(*(z[:n, :2] - post[0]).T).min() > 0.2
    assert z[n // 2, 1] < 0.0  # passes on the side it started on


def test_optimisation_lowers_the_cost_and_repeats_bit_for_bit():
    post = np.array([[1.0, 0.08]])
    a, b = (solve([(0, 0), (1, 0.3), (2, 0)], obstacles=post) for _ in range(2))
    assert a[1] == b[1]
    assert a[0].tobytes() == b[0].tobytes()


def test_association_takes_the_nearest_of_each_quadrant_within_reach():
    z = np.zeros((3, 4))
    near = np.empty((3, 4, 2))
    points = np.array([[0.5, 0.5], [0.3, 0.3], [0.3, -0.2], [-0.4, 0.1], [-3.0, -3.0]])
    associate(z, 3, points, 1.05, near)
    assert near[1, 0].tolist() == [0.3, 0.3]
    assert near[1, 1].tolist() == [-0.4, 0.1]
    assert near[1, 2].tolist() == [0.3, -0.2]
    assert np.isnan(near[1, 3]).all()
    assert np.isnan(near[[0, 2]]).all()


@given(st.lists(st.floats(0.01, 1.2), min_size=2, max_size=20), st.integers(0, 99))
def test_resizing_keeps_ends_and_total_time(times, seed):
    n = len(times) + 1
    random = np.random.default_rng(seed)
    z = np.zeros((SETTINGS.max_samples + 2, 4))
    z[:n, :3] = random.normal(size=(n, 3))
    z[: n - 1, 3] = times
    first, last = z[0, :3].copy(), z[n - 1, :3].copy()
    m = resize(z, n, PARAMETERS)
    assert SETTINGS.min_samples <= m <= SETTINGS.max_samples
    np.testing.assert_array_equal(z[0, :3], first)
    np.testing.assert_array_equal(z[m - 1, :3], last)
    assert z[: m - 1, 3].sum() == pytest.approx(sum(times))
    assert z[: m - 2, 3].max() <= 0.4 + 1e-12
    assert z[m - 2, 3] <= 0.6 + 1e-12  # may have taken in a short last interval
    if m > SETTINGS.min_samples:
        assert (z[: m - 1, 3] < 0.2 - 1e-12).sum() <= 1


points = st.tuples(st.floats(-3, 3), st.floats(-3, 3))
angles = st.floats(-3.1, 3.1)


@given(st.lists(points, min_size=2, max_size=6), angles, angles)
def test_any_initial_band_joins_its_ends_and_optimises_to_something_finite(path, start, goal):
    z, n = band_along(path, start, goal)
    assert 3 <= n <= SETTINGS.max_samples
    np.testing.assert_allclose(z[0, :3], [*path[0], start])
    np.testing.assert_allclose(z[n - 1, :2], path[-1], atol=1e-9)
    assert math.cos(z[n - 1, 2] - goal) == pytest.approx(1.0)
    assert (z[: n - 1, 3] > 0).all()
    n, motion, _ = optimize(z, n, 0.1, 0.2, NOTHING, PARAMETERS)
    assert math.isfinite(motion)
    assert np.isfinite(z[:n]).all()
    assert (z[: n - 1, 3] > 0).all()


def test_warm_start_cuts_what_has_been_driven():
    z, n = band_along([(0, 0), (2, 0)])
    kept = warm_start(z, n, 0.2, 0.01, 0.05, 2.1, 0.1, 0.2, SETTINGS.min_samples)
    assert kept == n - 2
    np.testing.assert_allclose(z[0, :3], [0.2, 0.01, 0.05])
    np.testing.assert_allclose(z[kept - 1, :3], [2.1, 0.1, 0.2])
