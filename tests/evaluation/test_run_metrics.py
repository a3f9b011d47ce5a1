import math

import pytest

from taskslam.evaluation import run_metrics
from taskslam.evaluation.upstream import ALL
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import load_run

FAR = SE2(3.0, 4.0, 1.0)


def metrics_of(builder, deviations=frozenset(), **changes):
    return run_metrics(load_run(builder.write(**changes)), "run", deviations)


def test_every_waypoint_gets_the_golden_values(build, golden_offsets):
    run = build(goals=2)
    for number, offset in enumerate(golden_offsets):
        run.round(number, {0: offset, 1: offset})
    metrics = metrics_of(run)
    assert metrics.completeness == 1.0
    for waypoint in metrics.waypoints:
        assert waypoint.complete
        assert waypoint.visits == 5
        assert waypoint.position.precision_m == pytest.approx(0.08)
        assert waypoint.position.accuracy_m == pytest.approx(0.08)
        assert waypoint.orientation.precision_rad == pytest.approx(0.06)
        assert waypoint.mean_pose == pytest.approx(waypoint.target)
    assert metrics.position.precision_m == pytest.approx(0.08)
    assert metrics.n_auc.published == pytest.approx(0.9375)
    assert metrics.n_auc.exact == pytest.approx(1 - 0.08 / 1.2)


def test_upstream_definitions_give_the_published_heading(build, golden_offsets):
    run = build(goals=1)
    for number, offset in enumerate(golden_offsets):
        run.round(number, {0: offset})
    assert metrics_of(run, deviations=ALL).orientation.precision_rad == pytest.approx(0.09772826, abs=1e-8)


def test_a_waypoint_missed_once_counts_only_against_completeness(build):
    run = build(goals=3, rounds=2)
    run.round(0, {0: SE2(0.1, 0, 0), 1: FAR, 2: SE2()})
    run.round(1, {0: SE2(-0.1, 0, 0)}, failed=(1, Outcome.NO_PLAN))
    metrics = metrics_of(run)
    assert [waypoint.visits for waypoint in metrics.waypoints] == [2, 1, 1]
    assert [waypoint.complete for waypoint in metrics.waypoints] == [True, False, False]
    assert metrics.completeness == pytest.approx(1 / 3)
    assert metrics.position.precision_m == pytest.approx(0.1)
    assert metrics.position.accuracy_m == pytest.approx(0.1)
    assert metrics.waypoints[1].position.accuracy_m == pytest.approx(5.0)
    assert metrics.waypoints[1].position.precision_m is None
    assert metrics.n_auc.exact == pytest.approx((1 - 0.1 / 1.2) / 3)


def test_precision_of_a_partly_reached_waypoint_ignores_rounds_that_never_arrived(build):
    run = build(goals=1, rounds=3)
    run.round(0, {0: SE2(0.1, 0, 0)}).round(1, {}, failed=(0, Outcome.BUMPED)).round(2, {0: SE2(-0.1, 0, 0)})
    waypoint = metrics_of(run).waypoints[0]
    assert waypoint.visits == 2
    assert waypoint.position.precision_m == pytest.approx(0.1)
    assert not waypoint.complete


def test_rounds_that_never_began_count_as_missed(build):
    metrics = metrics_of(build(goals=1, rounds=5).round(0, {0: SE2()}).round(1, {0: SE2()}))
    assert metrics.completeness == 0.0
    assert metrics.waypoints[0].rounds == 5


def test_the_priming_round_is_excluded_exactly_once(build):
    run = build(goals=1, rounds=2, mode="with-map")
    run.round(0, {0: FAR}, priming=True).round(1, {0: SE2(0.1, 0, 0)}).round(2, {0: SE2(-0.1, 0, 0)})
    metrics = metrics_of(run)
    assert metrics.waypoints[0].visits == 2
    assert [visit.round for visit in metrics.waypoints[0].arrivals] == [1, 2]
    assert metrics.position.precision_m == pytest.approx(0.1)
    assert metrics.completeness == 1.0


def test_upstream_counts_the_priming_round_and_drops_the_last(build):
    run = build(goals=1, rounds=2, mode="with-map")
    run.round(0, {0: FAR}, priming=True).round(1, {0: SE2(0.1, 0, 0)}).round(2, {0: SE2(-0.1, 0, 0)})
    metrics = metrics_of(run, deviations=ALL)
    assert [visit.round for visit in metrics.waypoints[0].arrivals] == [0, 1]
    assert metrics.position.precision_m == pytest.approx(math.hypot(2.9, 4.0) / 2)


def test_without_map_round_0_counts(build):
    run = build(goals=1, rounds=2).round(0, {0: SE2(0.1, 0, 0)}).round(1, {0: SE2(-0.1, 0, 0)})
    assert metrics_of(run).waypoints[0].visits == 2


def test_arrivals_are_keyed_by_goal_and_not_by_order(build):
    run = build(goals=3, rounds=2)
    run.round(0, {0: SE2(), 1: SE2(), 2: SE2()})
    run.round(1, {0: SE2(), 2: SE2()}, failed=(1, Outcome.NO_CONTROL))
    metrics = metrics_of(run)
    assert [waypoint.visits for waypoint in metrics.waypoints] == [2, 1, 2]
    assert metrics.waypoints[2].position.accuracy_m == pytest.approx(0.0)


def test_no_complete_waypoint_gives_zero_completeness_and_nulls(build):
    metrics = metrics_of(build(goals=2, rounds=2).round(0, {}, failed=(0, Outcome.NO_PLAN)))
    assert metrics.completeness == 0.0
    assert metrics.position.precision_m is None
    assert metrics.position.accuracy_m is None
    assert metrics.orientation.precision_rad is None
    assert metrics.n_auc.published == 0.0
    assert metrics.control.position_m is None
    assert metrics.waypoints[0].mean_pose is None


def test_one_round_has_accuracy_but_neither_precision_nor_curve(build):
    metrics = metrics_of(build(goals=1, rounds=1).round(0, {0: SE2(0.1, 0, 0)}))
    assert metrics.completeness == 1.0
    assert metrics.position.accuracy_m == pytest.approx(0.1)
    assert metrics.position.precision_m is None
    assert metrics.n_auc.published is None
    assert metrics.n_auc.exact is None


def test_control_and_estimation_error_are_told_apart(build):
    run = build(goals=1, rounds=2)
    run.round(0, {0: SE2(0.13, 0, 0)}, estimates={0: SE2(0.10, 0, 0)})
    run.round(1, {0: SE2(0.07, 0, 0)}, estimates={0: SE2(0.10, 0, 0)})
    metrics = metrics_of(run)
    assert metrics.control.position_m == pytest.approx(0.10)
    assert metrics.control.spread_m == pytest.approx(0.0, abs=1e-12)
    assert metrics.estimation.position_m == pytest.approx(0.03)
    assert metrics.estimation.spread_m == pytest.approx(0.03)
    assert metrics.position.precision_m == pytest.approx(0.03)


def test_an_arrival_without_a_measured_truth_is_a_visit_without_a_distance(build):
    metrics = metrics_of(build(goals=1, rounds=2).round(0, {0: None}).round(1, {0: None}))
    assert metrics.completeness == 1.0
    assert metrics.position.accuracy_m is None
    assert metrics.estimation.position_m is None
    assert metrics.control.position_m == pytest.approx(0.0)


def test_failures_say_where_when_and_why(build):
    run = build(goals=2, rounds=2)
    run.round(0, {0: SE2()}, failed=(1, Outcome.NO_PLAN)).round(1, {}, failed=(0, Outcome.CRASHED))
    metrics = metrics_of(run)
    assert [(f.round, f.goal, f.outcome, f.blames) for f in metrics.failures] == [
        (0, 1, "no_plan", "navigation"),
        (1, 0, "crashed", "method"),
    ]
    assert metrics.failures[0].detail == "said why"
    assert metrics.failures[0].truth == (10.0, 0.0, 0.0)
    assert metrics.failures[0].t_s == pytest.approx(4.0)
    assert metrics.failures_by_kind == {"crashed": 1, "no_plan": 1}


def test_time_and_frames_are_summed_over_all_rounds(build):
    run = build(goals=1, rounds=2, mode="with-map")
    run.round(0, {0: SE2()}, priming=True).round(1, {0: SE2()}).round(2, {0: SE2()})
    metrics = metrics_of(run)
    assert metrics.real_time_factor == pytest.approx(20.0)
    assert (metrics.frames, metrics.dropped_frames) == (300, 6)
    assert [summary.duration_s for summary in metrics.round_summaries] == [3.0, 3.0, 3.0]
    assert [summary.priming for summary in metrics.round_summaries] == [True, False, False]


def test_a_heading_of_many_turns_counts_as_the_direction_that_it_is(build):
    turned, plain = build("turned", goals=1, rounds=3), build("plain", goals=1, rounds=3)
    for number in range(3):
        turned.round(number, {0: SE2(0.01 * number, 0, 0.1 * number)})
        plain.round(number, {0: SE2(0.01 * number, 0, 0.1 * number)})
    turned.goals = [SE2(goal.x, goal.y, goal.theta + 6 * math.pi) for goal in turned.goals]
    one, other = metrics_of(turned), metrics_of(plain)
    assert one.orientation.accuracy_rad == pytest.approx(other.orientation.accuracy_rad)
    assert one.uncertainty.accuracy_rad.high == pytest.approx(other.uncertainty.accuracy_rad.high)
