"""Shares of noise, threads and a method's seed: known variances come back."""

import math

import numpy as np
import pytest

from taskslam.evaluation.spread_shares import log_precision, spread_shares


def drive(random, noise, own, sizes):
    """A result: the parts of noise, of the method's seed, and of threads, which nobody can hold."""
    parts = (np.random.default_rng([1, noise]).normal(), np.random.default_rng([2, own]).normal(), random.normal())
    return float(np.dot(sizes, parts))


def test_known_variances_come_back():
    random = np.random.default_rng(0)
    sizes = (2.0, 1.0, 1.0)  # variances 4, 1, 1
    n = 3000
    everything = [drive(random, i, i, sizes) for i in range(n)]
    noise_held = [[drive(random, g, 10_000 + 50 * g + i, sizes) for i in range(50)] for g in range(60)]
    seed_held = [[drive(random, 10_000 + 50 * g + i, g, sizes) for i in range(50)] for g in range(60)]
    same_run = [[drive(random, g, g, sizes) for _ in range(50)] for g in range(60)]
    found = spread_shares(everything, {"noise": noise_held, "seed": seed_held}, {"threads": same_run})
    assert [share.source for share in found] == ["noise", "seed", "threads"]
    assert [share.share for share in found] == pytest.approx([4 / 6, 1 / 6, 1 / 6], abs=0.07)
    for share in found:
        assert share.interval.low <= share.share <= share.interval.high
    assert sum(share.share for share in found) == pytest.approx(1.0, abs=0.1)


def test_intervals_hold_the_share_in_95_of_100_studies():
    random = np.random.default_rng(1)
    held = 0
    for _ in range(400):
        everything = random.normal(scale=2.0, size=10).tolist()
        alone = [random.normal(size=5).tolist(), random.normal(size=5).tolist()]
        (share,) = spread_shares(everything, alone={"threads": alone})
        held += share.interval.low <= 0.25 <= share.interval.high
    assert held / 400 == pytest.approx(0.95, abs=0.03)


def test_a_deterministic_method_owes_its_threads_nothing():
    (threads,) = spread_shares([1.0, 2.0, 3.0], alone={"threads": [[1.0, 1.0, 1.0], [2.0, 2.0]]})
    assert (threads.share, threads.interval.low, threads.interval.high, threads.runs) == (0.0, 0.0, 0.0, 5)


def test_what_says_nothing_is_refused():
    with pytest.raises(ValueError, match="noise: expected at least two runs"):
        spread_shares([1.0, 2.0], {"noise": [[1.0], [2.0, math.nan]]})
    with pytest.raises(ValueError, match="all alike"):
        spread_shares([1.0, 1.0], {})


def test_the_value_of_a_run_is_its_mean_log_precision(scattered):
    run = scattered("a", 0.02)
    assert log_precision(run) == pytest.approx(np.log([w.position.precision_m for w in run.waypoints]).mean())
