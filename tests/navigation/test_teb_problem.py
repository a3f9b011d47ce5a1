import math

import numpy as np
import pytest

from taskslam.navigation.settings import TebSettings
from taskslam.navigation.teb_problem import BAND, TebParameters, evaluate

PARAMETERS = TebParameters.of(TebSettings())


def random_band(seed, n=9):
    """A crooked band: every limit is broken somewhere."""
    random = np.random.default_rng(seed)
    z = np.zeros((n + 4, 4))
    z[:n, 0] = np.cumsum(random.uniform(-0.05, 0.25, n))
    z[:n, 1] = np.cumsum(random.normal(0, 0.08, n))
    z[:n, 2] = math.pi - 0.3 + np.cumsum(random.normal(0, 0.5, n))  # crosses the wrap
    z[:n, 3] = random.uniform(0.1, 0.5, n)
    near = np.full((n + 4, 4, 2), np.nan)
    near[:n] = z[:n, None, :2] + random.uniform(-0.5, 0.5, (n, 4, 2))
    near[3, 1] = np.nan
    return z, n, near


def costs(z, n, near, factor=2.0):
    H, g = np.zeros((4 * len(z), BAND)), np.zeros(4 * len(z))
    return evaluate(z, n, 0.2, -0.4, near, factor, PARAMETERS, True, H, g), H, g


@pytest.mark.parametrize("seed", range(12))
def test_the_gradient_is_that_of_the_cost(seed):
    z, n, near = random_band(seed)
    _, _, g = costs(z, n, near)
    step = 1e-7
    for k in range(4 * n - 1):
        if k // 4 in (0, n - 1) and k % 4 < 3:
            continue  # fixed ends: obstacles do not act on them
        moved = []
        for sign in (1, -1):
            other = z.copy()
            other[k // 4, k % 4] += sign * step
            moved.append(sum(costs(other, n, near)[0]))
        numeric = (moved[0] - moved[1]) / (2 * step)
        assert 2 * g[k] == pytest.approx(numeric, rel=1e-4, abs=1e-3), (k // 4, k % 4)


def test_the_gauss_newton_matrix_predicts_how_the_gradient_changes():
    # of the poses alone: their residuals are small here, so what Gauss-Newton leaves out is small too
    n = 8
    z = np.zeros((n, 4))
    z[:, 0] = 0.1 * np.arange(n)
    z[:, 3] = 0.3
    z[3, 1], z[4, 2] = 1e-4, 2e-4
    near = np.full((n, 4, 2), np.nan)
    _, H, g = costs(z, n, near)
    dense = np.zeros((4 * n, 4 * n))
    for i in range(4 * n):
        for k in range(min(BAND, i + 1)):
            dense[i, i - k] = dense[i - k, i] = H[i, k]
    direction = np.zeros((n, 4))
    direction[2:6, :3] = np.random.default_rng(1).normal(size=(4, 3))
    _, _, moved = costs(z + 1e-6 * direction, n, near)
    change, predicted = ((moved - g) / 1e-6).reshape(n, 4), (dense @ direction.ravel()).reshape(n, 4)
    np.testing.assert_allclose(change[:, :3], predicted[:, :3], rtol=2e-2, atol=0.5)


def test_a_band_within_all_limits_costs_its_time_alone():
    n = 12
    z = np.zeros((n, 4))
    speed = np.minimum(0.05 * np.arange(n - 1), 0.05 * np.arange(n - 2, -1, -1)) + 0.02
    z[:, 3] = 0.3
    z[1:, 0] = np.cumsum(np.minimum(speed, 0.2) * 0.3)
    near = np.full((n, 4, 2), np.nan)
    H, g = np.zeros((4 * n, BAND)), np.zeros(4 * n)
    motion, obstacles = evaluate(z, n, 0.0, 0.0, near, 1.0, PARAMETERS, False, H, g)
    assert obstacles == 0.0
    assert motion == pytest.approx((n - 1) * 0.3**2)


def test_obstacle_penalties_begin_at_the_published_distances():
    z = np.zeros((3, 4))
    z[:, 3] = 0.3
    H, g = np.zeros((12, BAND)), np.zeros(12)

    def at(distance):
        near = np.full((3, 4, 2), np.nan)
        near[1, 0] = (0.0, distance)
        return evaluate(z, 3, 0.0, 0.0, near, 1.0, PARAMETERS, False, H, g)[1]

    assert at(0.61) == 0.0
    assert at(0.5) == pytest.approx(0.1 * 0.1**2)  # inflation_dist 0.6, weight 0.1
    assert at(0.25) == pytest.approx(0.1 * 0.35**2 + 500 * 0.06**2)  # min_obstacle_dist 0.21 + penalty_epsilon 0.1
