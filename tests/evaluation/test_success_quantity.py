"""Success within 2 cm and 2 degrees: golden vectors by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from taskslam.evaluation import run_metrics
from taskslam.evaluation.quantities.success import SUCCESS
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import load_run


def metrics_of(builder):
    return run_metrics(load_run(builder.write()), "run")


def test_position_and_heading_must_both_be_within(build):
    degree = math.radians(1.0)
    run = build(goals=3, rounds=2)
    # Waypoint 1: 1.5 cm from the mean. Waypoint 2: 2.5 cm. Waypoint 3: at one place, but 3 degrees from the mean.
    run.round(0, {0: SE2(0.015, 0, 0), 1: SE2(0.025, 0, 0), 2: SE2(0, 0, 3 * degree)})
    run.round(1, {0: SE2(-0.015, 0, 0), 1: SE2(-0.025, 0, 0), 2: SE2(0, 0, -3 * degree)})
    metrics = metrics_of(run)
    assert [waypoint.quantities["success_2cm_2deg"] for waypoint in metrics.waypoints] == [1.0, 0.0, 0.0]
    assert metrics.quantities["success_2cm_2deg"].value == pytest.approx(2 / 6)


def test_what_was_missed_and_what_came_alone_are_failures(build):
    run = build(goals=2, rounds=2)
    run.round(0, {0: SE2(), 1: SE2()}).round(1, {0: SE2()}, failed=(1, Outcome.LOST))
    metrics = metrics_of(run)
    assert [waypoint.quantities["success_2cm_2deg"] for waypoint in metrics.waypoints] == [1.0, 0.0]
    assert metrics.quantities["success_2cm_2deg"].value == pytest.approx(2 / 4)
    assert SUCCESS.of_runs([metrics], [3]) == pytest.approx(2 / (4 + 3 * 2))  # a sequence that was never driven


def test_one_round_agrees_with_nothing(build):
    metrics = metrics_of(build(goals=2, rounds=1).round(0, {0: SE2(), 1: SE2()}))
    assert metrics.quantities["success_2cm_2deg"].value is None
    assert "success_2cm_2deg" not in metrics.waypoints[0].quantities


def test_its_interval_holds_it_and_is_wider_where_waypoints_differ(scattered):
    alike = scattered("alike", 0.012, rounds=5, goals=12).quantities["success_2cm_2deg"]
    assert 0 < alike.low < alike.value < alike.high < 1
    perfect = scattered("perfect", 0.0001, rounds=5, goals=12).quantities["success_2cm_2deg"]
    assert (perfect.value, perfect.high) == (1.0, 1.0)
    assert 0.9 < perfect.low < 1.0


def test_the_interval_holds_the_truth_nineteen_times_of_twenty(scattered):
    """300 runs of equal waypoints; the true share is that of a Rayleigh distance with a normal heading."""
    spread, tolerance = 0.012, 0.02
    rng = np.random.default_rng(1)
    errors = spread * rng.normal(size=(20000, 5, 3))
    errors -= errors.mean(axis=1, keepdims=True)
    near = (np.hypot(errors[..., 0], errors[..., 1]) <= tolerance) & (np.abs(errors[..., 2]) <= math.radians(2.0))
    truth = near.mean()
    found = [scattered(f"r{seed}", spread, seed=seed, goals=8).quantities["success_2cm_2deg"] for seed in range(150)]
    assert np.mean([one.low <= truth <= one.high for one in found]) > 0.92
