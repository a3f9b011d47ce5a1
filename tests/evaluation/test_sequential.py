"""Looking after every seed: alike methods are told apart in at most 5 % of campaigns, unlike ones soon."""

import itertools
import math

import numpy as np
import pytest

from taskslam.evaluation.sequential import decide, log_precisions, p_at_any_time, shift_interval, wealth


def test_the_expected_wealth_is_1_over_all_signs():
    """Exactly: the mean over every way to swap the two methods' runs, whatever the sizes are."""
    sizes = np.array([0.1, 3.0, 0.5, 0.5, 20.0, 1e-9])
    signs = np.array(list(itertools.product((1.0, -1.0), repeat=len(sizes))))
    assert wealth(signs * sizes).mean(axis=0) == pytest.approx(1.0)


def test_six_seeds_that_agree_decide_and_five_do_not():
    assert p_at_any_time([0.5] * 5) > 0.05
    assert p_at_any_time([-0.5] * 6) < 0.05
    assert p_at_any_time([]) == 1.0
    assert p_at_any_time([math.nan, 0.0]) == 1.0


@pytest.mark.parametrize("tails", ["normal", "t3", "signs"])
def test_alike_methods_are_told_apart_in_at_most_5_of_100_campaigns_at_any_time(tails):
    random = np.random.default_rng(3)
    draw = {
        "normal": random.standard_normal,
        "t3": lambda shape: random.standard_t(3, size=shape),
        "signs": lambda shape: random.choice([-1.0, 1.0], size=shape),
    }[tails]
    alarms = (p_at_any_time(draw((2000, 100))) <= 0.05).mean()
    assert 0.01 < alarms <= 0.05 + 2 * math.sqrt(0.05 * 0.95 / 2000)


def test_several_alike_methods_are_one_family():
    random = np.random.default_rng(5)
    alarms = 0
    for _ in range(120):
        drawn = random.normal(size=(3, 40)) + random.normal(size=40)
        alarms += len(decide(dict(zip("abc", drawn.tolist(), strict=True))).open) < 3
    assert alarms <= 120 * 0.05 + 2 * math.sqrt(120 * 0.05 * 0.95)


def test_the_best_is_named_once_it_is_told_from_every_other():
    random = np.random.default_rng(6)
    logs = {name: (at + 0.2 * random.normal(size=40)).tolist() for name, at in (("b", 0.6), ("a", 0.0), ("c", 0.62))}
    early = decide({name: own[:4] for name, own in logs.items()})
    assert (early.best, early.decided, len(early.open)) == (None, False, 3)
    late = decide(logs)
    assert (late.best, late.decided) == ("a", True)
    assert [(pair.a, pair.b) for pair in late.open] == [("b", "c")]
    assert "a is the most repeatable" in late.words
    assert not decide(logs, all_pairs=True).decided
    assert decide(logs, all_pairs=True, alike=math.log(1.5)).decided
    first = late.pairs[0]
    assert first.better == "a"
    assert first.interval.low < math.exp(-0.6) < first.interval.high


def test_the_interval_holds_the_shift_at_every_look():
    random = np.random.default_rng(7)
    missed = 0
    for _ in range(40):
        d = 0.3 + 0.2 * random.standard_t(3, size=25)
        looks = [shift_interval(d[:n].tolist()) for n in range(6, 26, 3)]
        missed += any(look is not None and not look.low <= 0.3 <= look.high for look in looks)
    assert missed <= 5
    assert shift_interval([0.1, 0.2, 0.15]) is None


def test_methods_are_compared_where_all_arrived(scattered):
    runs = {
        "good": [scattered(f"g{s}", 0.01, seed=s, seed_name=s) for s in range(2)],
        "late": [scattered(f"l{s}", 0.05, seed=s + 9, seed_name=s, fails_at=4) for s in range(3)],
    }
    logs = log_precisions(runs)
    first = [w.position.precision_m for w in runs["good"][0].waypoints[:4]]
    assert logs["good"][0] == pytest.approx(np.log(first).mean())
    assert [len(own) for own in logs.values()] == [2, 2]


def test_one_method_is_nothing_to_compare():
    with pytest.raises(ValueError, match="two methods"):
        decide({"a": [1.0]})
