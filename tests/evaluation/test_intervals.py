import math

import numpy as np
import pytest

from taskslam.evaluation import intervals
from taskslam.evaluation.intervals import precision_bias, precision_table, ratio_of, rounds_to_halve, two_way_variance


def held(make, true_mean, trials=300, seed=0):
    """Share of trials whose 95 % interval for E, over rounds and waypoints, holds the true mean."""
    random, hits = np.random.default_rng(seed), 0
    for _ in range(trials):
        positions = make(random)
        E = intervals.mean_distance(positions).mean()
        variance = two_way_variance([precision_table(positions)])
        half = intervals.log_half_width(E, variance.total, variance.total_freedom)
        hits += abs(math.log(true_mean / E)) <= half
    return hits / trials


def rayleigh(rounds):
    """Expected E of isotropic Gaussian scatter of 1 in each axis."""
    return math.sqrt(math.pi / 2) * precision_bias(rounds)


def test_few_rounds_make_precision_too_small_by_the_known_factor():
    random = np.random.default_rng(0)
    for rounds in (2, 3, 5, 10):
        E = intervals.mean_distance(random.normal(size=(4000, rounds, 4, 2))).mean()
        assert math.isclose(E, rayleigh(rounds), rel_tol=0.01)
    assert precision_bias(5) == pytest.approx(0.894, abs=5e-4)  # protocol 7.3 #9
    with pytest.raises(ValueError, match="at least 2"):
        precision_bias(1)


def test_the_interval_holds_when_arrivals_are_independent():
    assert held(lambda random: random.normal(size=(5, 12, 2)), rayleigh(5)) > 0.91


def test_the_interval_holds_when_a_round_shares_its_error_among_all_waypoints():
    share = held(lambda random: random.normal(size=(5, 1, 2)) + 0.01 * random.normal(size=(5, 12, 2)), rayleigh(5))
    assert share > 0.91


def test_the_interval_holds_when_waypoints_differ():
    def make(random):
        return random.normal(size=(5, 12, 2)) * np.exp(random.normal(0, 0.5, (12, 1)))

    assert held(make, rayleigh(5) * math.exp(0.125)) > 0.90


def test_treating_arrivals_as_independent_would_not_hold():
    """The defect that the two-way variance is there to avoid: N waypoints of one drive are no N witnesses."""
    random, hits = np.random.default_rng(0), 0
    for _ in range(300):
        positions = random.normal(size=(5, 1, 2)) + 0.01 * random.normal(size=(5, 12, 2))
        distances = np.linalg.norm(positions - positions.mean(axis=0), axis=-1)
        half = 1.96 * distances.std(ddof=1) / math.sqrt(distances.size)
        hits += abs(distances.mean() - rayleigh(5)) <= half
    assert hits / 300 < 0.6


def test_the_variance_is_that_of_the_crossed_table_by_hand():
    table = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 9.0]])
    of_rounds = table.mean(axis=1).var(ddof=1) / 3
    of_waypoints = table.mean(axis=0).var(ddof=1) / 2
    rest = table - table.mean(axis=1, keepdims=True) - table.mean(axis=0) + table.mean()
    found = two_way_variance([table])
    assert found.rounds == pytest.approx(of_rounds)
    assert found.rounds_freedom == pytest.approx(2)
    assert found.total == pytest.approx(of_rounds + of_waypoints - (rest**2).sum() / 2 / 6)


def test_rounds_of_several_runs_add_up():
    tables = [np.array([[1.0], [3.0], [2.0]]), np.array([[2.0, 2.0], [4.0, 6.0]])]
    expected = (1 / 3) ** 2 * tables[0].mean(axis=1).var(ddof=1) / 3 + (2 / 3) ** 2 * np.var([2, 5], ddof=1) / 2
    assert two_way_variance(tables).rounds == pytest.approx(expected)


def test_pseudo_values_of_identical_arrivals_vary_not_at_all():
    positions = np.tile([[1.0, 2.0], [3.0, 4.0]], (5, 1, 1))
    assert two_way_variance([precision_table(positions)]).total == 0.0


@pytest.mark.parametrize("table", [np.ones((1, 4)), np.ones((4, 0)), np.ones(4)])
def test_a_table_without_scatter_is_refused(table):
    with pytest.raises(ValueError, match="at least two rounds"):
        two_way_variance([table])


def test_two_rounds_leave_nothing_when_one_is_taken_out():
    with pytest.raises(ValueError, match="at least 3"):
        precision_table(np.zeros((2, 4, 2)))


def test_thirteen_rounds_halve_the_interval_of_five():
    assert rounds_to_halve(5) == 13
    assert rounds_to_halve(3) < 8  # t with two degrees of freedom is that wide
    assert rounds_to_halve(30) == 113  # without the tail of t it would be 120
    with pytest.raises(ValueError, match="at least 3"):
        rounds_to_halve(2)


def test_headings_are_treated_across_the_seam():
    random = np.random.default_rng(0)
    headings = 0.05 * random.normal(size=(5, 6))
    table = intervals.heading_table(headings)
    turned = intervals.heading_table(np.angle(np.exp(1j * (headings + math.pi))))
    assert turned == pytest.approx(table, abs=1e-12)


def test_a_ratio_beyond_all_bounds_does_not_overflow():
    assert ratio_of(1e300) == pytest.approx(math.exp(100))
    assert ratio_of(-1e300) == pytest.approx(math.exp(-100))
    assert ratio_of(0.7) == math.exp(0.7)
