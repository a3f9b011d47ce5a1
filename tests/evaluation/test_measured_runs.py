"""Runs of real robots: waypoints without a camera, and true poses whose place in the map nobody knows."""

import pytest

from taskslam.errors import RecordError
from taskslam.evaluation import evaluate_runs, run_metrics
from taskslam.evaluation.comparison import compare_pair
from taskslam.evaluation.pooled import pool
from taskslam.evaluation.tolerance import arrival_spread
from taskslam.geometry import SE2
from taskslam.record import load_run

OFFSETS = (SE2(0.1, 0.0, 0.02), SE2(-0.1, 0.05, -0.02), SE2(0.0, -0.05, 0.0))


def tour(build, name="run", **changes):
    """Waypoint 1 has a camera, 2 has none, 3 was missed once."""
    run = build(name, goals=3, rounds=3)
    for number, offset in enumerate(OFFSETS):
        third = {} if number == 1 else {2: offset}
        run.round(number, {0: offset, 1: None, **third})
    return run.write(source="measured", unjudged={1: "no camera watches it"}, **changes)


def test_a_waypoint_without_a_camera_leaves_every_denominator(build):
    metrics = run_metrics(load_run(tour(build)), "run")
    assert (metrics.complete_waypoints, metrics.planned_waypoints) == (1, 2)
    assert metrics.completeness == 0.5
    assert metrics.waypoints[1].unjudged == "no camera watches it"
    assert not metrics.waypoints[1].complete
    assert metrics.n_auc.exact == pytest.approx(0.5 * (1 - metrics.waypoints[0].position.precision_m / 1.2))
    pooled = pool([metrics])
    assert (pooled.complete_waypoints, pooled.planned_waypoints, pooled.completeness) == (1, 2, 0.5)
    assert arrival_spread([metrics]).planned == 6


def test_poses_without_a_place_in_the_map_have_precision_and_no_accuracy(build):
    local = run_metrics(load_run(tour(build, truth_frame="waypoint")), "run")
    known = run_metrics(load_run(tour(build, "known")), "known")
    assert local.position.precision_m == known.position.precision_m is not None
    assert local.orientation.precision_rad == known.orientation.precision_rad
    assert local.iso9283.pose_repeatability_m == known.iso9283.pose_repeatability_m
    assert local.control.position_m == known.control.position_m
    nothing = (
        local.position.accuracy_m,
        local.orientation.accuracy_rad,
        local.iso9283.pose_accuracy_m,
        local.iso9283.pose_accuracy_rad,
        local.estimation.position_m,
        local.estimation.spread_m,
        local.uncertainty.accuracy_m,
        local.uncertainty.accuracy_rad,
    )
    assert nothing == (None,) * len(nothing)
    assert local.uncertainty.precision_m == known.uncertainty.precision_m is not None


def test_methods_without_a_place_in_the_map_are_compared_by_precision_alone(build):
    runs = [run_metrics(load_run(tour(build, name, truth_frame="waypoint")), name) for name in ("a", "b")]
    assert compare_pair("a", runs[:1], "b", runs[1:], "precision").waypoints == 1
    assert compare_pair("a", runs[:1], "b", runs[1:], "accuracy").waypoints == 0


def test_the_metrics_file_of_a_measured_run_is_written_whole(build):
    folder = tour(build, truth_frame="waypoint")
    (metrics,) = evaluate_runs([folder]).runs
    assert metrics.truth_frame == "waypoint"


def test_a_run_that_no_camera_watched_is_named(build):
    folder = build(goals=1).round(0, {0: None}).write(unjudged={0: "no camera watches it"})
    with pytest.raises(RecordError, match="none of the waypoints can be judged: no camera"):
        run_metrics(load_run(folder), "run")


def test_a_waypoint_past_the_sequence_cannot_be_unjudged(build):
    folder = build(goals=1).round(0, {0: OFFSETS[0]})
    with pytest.raises(RecordError, match="unjudged names goal 4 of 1"):
        folder.write(unjudged={4: "no camera"})
