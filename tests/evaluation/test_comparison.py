import re

import pytest

from taskslam.evaluation.comparison import compare_methods, compare_pair, corrected


def test_a_method_that_is_five_times_as_repeatable_is_told_apart(scattered):
    good, bad = scattered("good", 0.01), scattered("bad", 0.05, seed=1)
    found = compare_pair("good", [good], "bad", [bad])
    assert found.told_apart
    assert found.ratio_interval.low < found.ratio < found.ratio_interval.high < 1
    assert found.p_permutation == pytest.approx(2 / 252)
    assert found.cliffs_delta == -1.0
    assert found.better_at == found.waypoints == 6
    sentence = (
        r"good is more repeatable than bad here: [\d.]+ against [\d.]+ cm at 6 common waypoints, one seed,"
        r" ratio 0\.\d+ \["
    )
    assert re.match(sentence, found.verdict)


def test_the_verdict_names_the_better_one_first_whichever_way_round(scattered):
    good, bad = scattered("good", 0.01), scattered("bad", 0.05, seed=1)
    there, back = compare_pair("good", [good], "bad", [bad]), compare_pair("bad", [bad], "good", [good])
    assert back.verdict == there.verdict
    assert back.ratio == pytest.approx(1 / there.ratio)
    assert back.p == pytest.approx(there.p)
    assert back.cliffs_delta == -there.cliffs_delta


def test_methods_alike_are_not_told_apart_and_it_says_so(scattered):
    found = compare_pair("a", [scattered("a", 0.02)], "b", [scattered("b", 0.02, seed=1)])
    assert not found.told_apart
    assert found.verdict.startswith("The data do not tell a from b: ")
    assert found.ratio_interval.low < 1 < found.ratio_interval.high


def test_three_rounds_tell_nothing_apart(scattered):
    found = compare_pair("a", [scattered("a", 0.001, rounds=3)], "b", [scattered("b", 0.5, rounds=3, seed=1)])
    assert found.p < 0.05
    assert not found.told_apart
    assert "3 rounds are too few" in found.verdict


def test_two_rounds_have_no_interval(scattered):
    found = compare_pair("a", [scattered("a", 0.01, rounds=2)], "b", [scattered("b", 0.02, rounds=2, seed=1)])
    assert found.ratio_interval is None
    assert not found.told_apart
    assert found.verdict.startswith("2 rounds cannot tell a from b")


def test_only_waypoints_that_both_completed_are_compared(scattered):
    found = compare_pair("a", [scattered("a", 0.01)], "b", [scattered("b", 0.01, seed=1, fails_at=4)])
    assert (found.waypoints, found.a_only, found.b_only) == (4, 2, 0)


def test_without_a_common_waypoint_there_is_no_comparison(scattered):
    found = compare_pair("a", [scattered("a", 0.01)], "b", [scattered("b", 0.01, fails_at=0)])
    assert found.ratio is None
    assert "cannot be compared: no waypoint was completed by both" in found.verdict
    other = scattered("c", 0.01, scenario_name="elsewhere")
    assert "no waypoint was driven by both" in compare_pair("a", [scattered("d", 0.01)], "c", [other]).verdict


def test_accuracy_is_compared_against_the_goal(scattered):
    near, far = scattered("near", 0.01, bias=0.05), scattered("far", 0.01, bias=0.3, seed=1)
    assert compare_pair("near", [near], "far", [far], "accuracy").told_apart
    assert "more accurate" in compare_pair("near", [near], "far", [far], "accuracy").verdict
    assert not compare_pair("near", [near], "far", [far], "precision").told_apart
    with pytest.raises(ValueError, match="unknown metric 'speed'"):
        compare_pair("near", [near], "far", [far], "speed")


def test_arrivals_that_repeat_to_the_bit_are_no_trouble(scattered):
    found = compare_pair("a", [scattered("a", 0.0)], "b", [scattered("b", 0.0)])
    assert found.ratio == 1.0
    assert not found.told_apart


def test_few_rounds_do_not_flatter(scattered):
    """E of 5 rounds is 0.89, of 20 rounds 0.97 of the truth: the ratio must not see a difference in that."""
    few = [scattered(f"few{n}", 0.02, seed=n, seed_name=n) for n in range(8)]
    many = [scattered(f"many{n}", 0.02, seed=100 + n, seed_name=n, rounds=20) for n in range(8)]
    ratio = compare_pair("few", few, "many", many).ratio
    assert ratio == pytest.approx(1.0, abs=0.06)


def test_many_sequences_are_judged_by_whole_runs(scattered):
    a = [scattered(f"a{n}", 0.01, goals=2, seed=n, seed_name=n) for n in range(10)]
    b = [scattered(f"b{n}", 0.03, goals=2, seed=50 + n, seed_name=n) for n in range(10)]
    found = compare_pair("a", a, "b", b)
    assert found.p_permutation_floor == pytest.approx(2 / 1024)
    assert found.told_apart
    assert found.waypoints == 20


def test_every_pair_of_a_mode_is_compared_and_corrected_together(scattered):
    spreads = {"a": 0.01, "b": 0.02, "c": 0.1}
    groups = {name: [scattered(name, spread, seed=n)] for n, (name, spread) in enumerate(spreads.items())}
    groups["d"] = [scattered("d", 0.01, mode="with-map")]
    found = compare_methods(groups)
    assert [(c.a, c.b) for c in found] == [("a", "b"), ("a", "c"), ("b", "c")]
    assert min(c.p_adjusted / c.p for c in found) >= 1
    smallest = min(found, key=lambda c: c.p)
    assert smallest.p_adjusted == pytest.approx(3 * smallest.p)
    assert "corrected for 3 comparisons" in smallest.verdict


def test_what_one_pair_shows_may_not_stand_among_many(scattered):
    pair = compare_pair("a", [scattered("a", 0.02)], "b", [scattered("b", 0.045, seed=3)])
    assert pair.told_apart
    alike = [
        compare_pair("a", [scattered(f"x{n}", 0.02, seed=n)], "b", [scattered(f"y{n}", 0.02, seed=99 + n)])
        for n in range(4)
    ]
    family = corrected([pair, *alike * 100])
    assert not family[0].told_apart
    assert family[0].verdict.startswith("The data do not tell a from b")
