"""Choosing a method: the one that is named is the best, or within the margin of it, as often as is said."""

import math

import numpy as np
import pytest

from taskslam.evaluation.choice import MARGIN, Score, race, score_of, standings


def lab(random, shares, costs, spread=0.5, planned=60):
    """Drives methods whose seeds differ: the logarithm of their odds is normal with this deviation about the share."""

    def drive(methods, seed):
        odds = {name: math.log(shares[name] / (1 - shares[name])) + spread * random.normal() for name in methods}
        return {
            name: Score(int(random.binomial(planned, 1 / (1 + math.exp(-odds[name])))), planned, costs[name])
            for name in methods
        }

    return drive


def true_share(share, spread=0.5):
    """The mean over seeds: that of the odds' distribution is a little nearer to a half."""
    at = math.log(share / (1 - share)) + spread * np.random.default_rng(0).standard_normal(20000)
    return float((1 / (1 + np.exp(-at))).mean())


def test_who_is_named_with_95_percent_is_the_best_as_often_as_is_said():
    random = np.random.default_rng(1)
    right = sure = driven = 0
    for _ in range(60):
        names = [f"m{index}" for index in range(8)]
        shares = dict(zip(names, random.uniform(0.05, 0.97, 8).tolist(), strict=True))
        costs = dict(zip(names, random.uniform(0.01, 1.0, 8).tolist(), strict=True))
        *_, last = race(names, lab(random, shares, costs), most_seeds=12)
        driven += sum(one.seeds for one in last)
        if last[0].probability >= 0.95:
            sure += 1
            truth = {name: true_share(share) for name, share in shares.items()}
            right += truth[last[0].method] >= max(truth.values()) - MARGIN
    assert sure > 25
    assert right / sure >= 0.88  # 95 % less two deviations of 45 campaigns
    assert driven < 0.5 * 60 * 8 * 12  # what elimination saves


def test_a_hopeless_method_is_dropped_and_driven_no_more():
    seen = []

    def drive(methods, seed):
        seen.append(methods)
        return {name: Score({"good": 58, "fair": 57, "bad": 5}[name] - seed % 2, 60, 0.1) for name in methods}

    last = list(race(["good", "bad", "fair"], drive, most_seeds=5))[-1]
    assert "bad" in seen[1]
    assert all("bad" not in methods for methods in seen[2:])
    assert last[-1].method == "bad"
    assert last[-1].dropped
    assert last[-1].seeds == 2


def test_among_equals_the_cheaper_is_chosen():
    scores = {"dear": [Score(60, 60, 2.0)] * 4, "cheap": [Score(60, 60, 0.1)] * 4}
    first, second = standings(scores)
    assert first.method == "cheap"
    assert first.probability > 0.8
    assert first.probability + second.probability == pytest.approx(1.0)


def test_one_seed_names_nobody():
    found = standings({"a": [Score(60, 60, 0.1)], "b": [Score(3, 60, 0.1)]})
    assert [one.probability for one in found] == [0.5, 0.5]
    assert found[0].method == "a"


def test_a_method_that_cannot_be_driven_is_left_out():
    def drive(methods, seed):
        return {name: Score(50 + seed, 60, 0.1) for name in methods if name != "gone"}

    last = list(race(["gone", "there"], drive))[-1]
    assert [one.method for one in last] == ["there"]
    assert list(race(["gone"], drive)) == []


def test_a_score_counts_arrivals_within_the_tolerance(scattered):
    run = scattered("a", 0.02, fails_at=4)
    every = score_of([run], 10.0)
    assert (every.hits, every.planned) == (4 * 6 + 4, 30)  # two arrivals were missed
    near = score_of([run], 0.02)
    assert 0 < near.hits < every.hits
    assert score_of([run], 10.0, 1e-6).hits == 0
    assert every.cost == pytest.approx(run.compute_s / run.simulated_s)
    with pytest.raises(ValueError, match="no run"):
        score_of([], 0.02)
