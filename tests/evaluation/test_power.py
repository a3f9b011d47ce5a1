"""How many runs: the power that a plan states is the power that campaigns have."""

import math

import numpy as np
import pytest

from taskslam.evaluation.evidence import ALPHA, Side, weigh_seeds
from taskslam.evaluation.power import (
    POWER,
    Scatter,
    pooled_scatter,
    power_of,
    runs_needed,
    scatter_of,
    seeds_needed,
)

PLACES = [("synthetic", 0), ("synthetic", 1)]


def campaign(random, design, scatter, ratio):
    """Whether both tests tell two methods apart whose log E scatters as the plan was told."""
    sides = []
    for size in (1.0, ratio):
        rounds = scatter.rounds * random.normal(size=(design.seeds, design.rounds))
        logs = math.log(size) + scatter.seeds * random.normal(size=design.seeds) + rounds.mean(axis=1)
        sides.append(np.repeat(logs[:, None], 2, axis=1))
    visits = np.zeros((2, 2, 3))
    pairs = [
        (seed, PLACES, *(Side(visits, visits[0], np.exp(own[seed]), own[seed], None) for own in sides))
        for seed in range(design.seeds)
    ]
    found = weigh_seeds(pairs, "")
    return found.p() < ALPHA and found.permutation[0] < ALPHA


@pytest.mark.parametrize(
    ("detect", "scatter", "campaigns"), [(1.0, Scatter(0.3, 0.3), 800), (0.3, Scatter(0.1, 0.3), 800)]
)
def test_the_stated_power_is_that_of_campaigns(detect, scatter, campaigns):
    """benchmarks/seed_coverage.py does nine plans by 2000 campaigns each."""
    random = np.random.default_rng(4)
    design = runs_needed(detect, scatter)
    told = np.mean([campaign(random, design, scatter, 1 + detect) for _ in range(campaigns)])
    assert POWER <= design.power <= 1.0
    assert told == pytest.approx(design.power, abs=0.05)


def test_a_verdict_needs_six_seeds_however_large_the_difference():
    assert runs_needed(20.0, Scatter(0.01, 0.01)).seeds == 6
    assert power_of(20.0, 1e-6, 5) == 0.0


def test_a_smaller_difference_and_more_methods_need_more_seeds():
    scatter = Scatter(0.2, 0.4)
    plain = runs_needed(0.2, scatter, rounds=5)
    assert runs_needed(0.1, scatter, rounds=5).seeds > 3 * plain.seeds
    assert runs_needed(0.2, scatter, rounds=5, comparisons=28).seeds > plain.seeds
    assert runs_needed(0.01, Scatter(0.5, 0.0)) is None
    with pytest.raises(ValueError, match="more than 0"):
        runs_needed(0.0)


def test_a_plan_is_said_in_words():
    design = runs_needed()
    assert design.words == f"{design.seeds} seeds of 5 rounds, power {design.power:.0%}"
    assert design.driven() == design.seeds * 5
    assert design.driven(with_map=True) == design.seeds * 6


def test_rounds_pay_only_where_rounds_scatter():
    assert runs_needed(0.2, Scatter(0.2, 0.0), with_map=True).rounds == 5
    assert runs_needed(0.2, Scatter(0.0, 0.6), with_map=True).rounds > 5  # a priming round for each seed


def test_seeds_needed_by_the_t_test_of_large_samples():
    # (1.96 + 0.84)^2 / effect^2 for a standardised difference of 0.2, and a little more for Student's t
    assert seeds_needed(0.2, 1.0) == pytest.approx((1.95996 + 0.84162) ** 2 / 0.2**2, abs=3)
    assert seeds_needed(0.0, 1.0) is None


def test_scatter_is_measured_from_runs(scattered):
    factors = np.exp(0.5 * np.random.default_rng(2).normal(size=8))
    runs = [scattered(f"s{s}", 0.02 * f, goals=8, seed=s + 50, seed_name=s) for s, f in enumerate(factors)]
    found = scatter_of(runs)
    assert found.seeds == pytest.approx(np.log(factors).std(ddof=1), rel=0.35)
    assert 0.02 < found.rounds < 1.0
    assert scatter_of(runs[:1]) is None
    both = pooled_scatter([found, Scatter(0.0, 0.0)])
    assert both.seeds == pytest.approx(found.seeds / math.sqrt(2))
