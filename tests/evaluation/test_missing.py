"""Arrivals that the measurement lost: tables with holes, and intervals that still hold what they promise."""

import numpy as np
import pytest

from taskslam.evaluation import intervals, run_metrics
from taskslam.evaluation.comparison import compare_pair
from taskslam.evaluation.evidence import _log_ratio_of_spreads
from taskslam.evaluation.missing import filled
from taskslam.evaluation.tolerance import arrival_spread
from taskslam.evaluation.uncertainty import Sample, uncertainty
from taskslam.geometry import SE2
from taskslam.record import load_run


def test_a_filled_column_has_the_mean_of_its_values_and_the_variance_of_that_mean():
    table = np.random.default_rng(0).normal(size=(5, 3))
    table[1, 0] = table[0, 2] = table[4, 2] = np.nan
    whole = filled(table)
    np.testing.assert_allclose(whole.mean(axis=0), np.nanmean(table, axis=0))
    m = (~np.isnan(table)).sum(axis=0)
    np.testing.assert_allclose(whole.var(axis=0, ddof=1) / 5, np.nanvar(table, axis=0, ddof=1) / m)
    np.testing.assert_array_equal(whole[:, 1], table[:, 1])


def test_a_column_of_one_value_is_left_out_and_a_whole_table_is_itself():
    table = np.arange(12.0).reshape(3, 4)
    assert filled(table) is table
    table[:2, 1] = np.nan
    np.testing.assert_array_equal(filled(np.stack([table, table]))[1], table[:, [0, 2, 3]])
    table[:2] = np.nan
    assert filled(table) is None


def test_precision_of_fewer_rounds_is_brought_to_all_of_them():
    positions = np.random.default_rng(1).normal(size=(5, 2, 2))
    four = positions.copy()
    four[2, 0] = np.nan
    E = intervals.mean_distance(four)
    left = np.delete(positions, 2, axis=0)
    factor = intervals.precision_bias(5) / intervals.precision_bias(4)
    np.testing.assert_allclose(E, intervals.mean_distance(left)[0] * factor * np.array([1, 0]) + [0, E[1]])
    assert E[1] == pytest.approx(intervals.mean_distance(positions)[1])
    without = intervals.without_each_round(four)
    assert np.isnan(without).tolist() == np.isnan(four[..., 0]).tolist()
    kept = [0, 1, 3, 4]
    np.testing.assert_allclose(without[kept, 0], intervals.without_each_round(left)[:, 0] * factor)
    np.testing.assert_allclose(without[:, 1], intervals.without_each_round(positions)[:, 1])


def test_one_visit_has_no_precision():
    positions = np.full((3, 2, 2), np.nan)
    positions[0, 0] = 1.0
    assert np.isnan(intervals.mean_distance(positions)).all()


@pytest.mark.parametrize("shared", [0.0, 0.9])
def test_intervals_hold_the_truth_as_often_with_one_arrival_in_twenty_lost(shared):
    """600 synthetic runs over waypoints of unequal scatter, which leave 0.9 % of standard error."""
    random = np.random.default_rng(7)
    many = random.normal(size=(5, 20000, 2))
    true = np.array([intervals.mean_distance(many).mean(), np.linalg.norm(many, axis=-1).mean()]) * np.exp(0.5**2 / 2)
    hits = np.zeros(2)
    for _ in range(600):
        own, together = random.normal(size=(5, 12, 3)), random.normal(size=(5, 1, 3))
        scale = np.exp(random.normal(0, 0.5, (12, 1)))
        visits = ((1 - shared) ** 0.5 * own + shared**0.5 * together) * scale
        visits[random.random((5, 12)) < 0.05] = np.nan
        found = uncertainty([Sample(visits, np.zeros((12, 3)), 12, 12, 5, False, "abort", 60, 0)])
        for number, (interval, value) in enumerate(zip((found.precision_m, found.accuracy_m), true, strict=True)):
            hits[number] += interval.low <= value <= interval.high
    assert ((hits / 600 > 0.93) & (hits / 600 < 0.98)).all(), hits / 600


def test_two_rounds_left_have_a_mean_and_no_variance_of_their_own():
    visits = np.random.default_rng(2).normal(size=(3, 4, 3))
    visits[0, 1] = np.nan
    sample = Sample(visits, np.zeros((4, 3)), 4, 4, 3, False, "abort", 12, 0)
    found = uncertainty([sample])
    E = intervals.mean_distance(visits[..., :2])
    assert found.precision_m.low < E.mean() < found.precision_m.high
    assert found.precision_unbiased_m == pytest.approx(E.mean() / intervals.precision_bias(3))
    visits[0] = np.nan
    assert uncertainty([sample]).precision_m is None
    assert uncertainty([sample]).accuracy_m is not None


def measured(build, name="run", lost=(), seed=0, failed=None, rounds=5):
    """A measured run over three goals; lost: (round, goal) without a pose."""
    random = np.random.default_rng(seed)
    run = build(name, goals=3, rounds=rounds)
    for number in range(rounds):
        offsets = {goal: SE2(*random.normal(0, 0.05, 3)) for goal in range(3)}
        kept = {goal: None if (number, goal) in lost else at for goal, at in offsets.items()}
        if failed and failed[0] == number:
            kept = {goal: at for goal, at in kept.items() if goal < failed[1]}
        run.round(number, kept)
    return run_metrics(load_run(run.write(source="measured", method=name)), name)


def test_a_waypoint_is_judged_on_the_rounds_that_were_measured(build):
    whole, metrics = measured(build, "whole"), measured(build, "part", lost={(2, 1)})
    waypoint = metrics.waypoints[1]
    assert (waypoint.complete, waypoint.visits, waypoint.rounds, metrics.rounds) == (True, 4, 4, 5)
    assert (metrics.complete_waypoints, metrics.planned_waypoints, metrics.completeness) == (3, 3, 1.0)
    left = np.array([visit.truth for visit in waypoint.arrivals if visit.truth is not None])[:, None]
    E = intervals.mean_distance(left[..., :2])[0]
    factor = intervals.precision_bias(5) / intervals.precision_bias(4)
    assert waypoint.position.precision_m == pytest.approx(E * factor)
    assert waypoint.position.accuracy_m == pytest.approx(np.hypot(left[..., 0] - 10, left[..., 1]).mean())
    for other in (0, 2):
        assert metrics.waypoints[other] == whole.waypoints[other]
    assert metrics.n_auc.exact == pytest.approx(np.mean([1 - w.position.precision_m / 1.2 for w in metrics.waypoints]))
    assert metrics.uncertainty.precision_m is not None
    assert metrics.uncertainty.legs.driven == whole.uncertainty.legs.driven - 1
    assert arrival_spread([metrics]).planned == 14


def test_a_lost_arrival_hides_no_failure(build):
    metrics = measured(build, lost={(2, 2)}, failed=(4, 2))
    waypoint = metrics.waypoints[2]
    assert (waypoint.complete, waypoint.visits, waypoint.rounds) == (False, 3, 4)


def test_methods_are_compared_at_waypoints_with_lost_arrivals(build):
    a, b = measured(build, "a", lost={(0, 0), (1, 0), (3, 1)}), measured(build, "b", lost={(4, 2)}, seed=1)
    for metric in ("precision", "accuracy"):
        found = compare_pair("a", [a], "b", [b], metric)
        assert found.waypoints == 3
        assert 0 < found.p <= 1
        assert found.ratio_interval.low < found.ratio < found.ratio_interval.high
    assert found.a_mean_m == pytest.approx(a.position.accuracy_m)


def test_a_waypoint_dealt_too_few_visits_says_nothing():
    rounds = np.random.default_rng(0).normal(size=(2, 4, 3, 2))
    known = _log_ratio_of_spreads(rounds[:1, :, :2], rounds[1:, :, :2])
    rounds[0, 1:, 2] = np.nan
    assert _log_ratio_of_spreads(rounds[:1], rounds[1:]) == pytest.approx(known)
