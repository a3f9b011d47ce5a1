"""The estimation share of E: golden vectors, and squares that add."""

from __future__ import annotations

import numpy as np
import pytest

from taskslam.evaluation import run_metrics
from taskslam.geometry import SE2
from taskslam.record import load_run


def metrics_of(builder):
    return run_metrics(load_run(builder.write()), "run")


def test_only_what_differs_between_truth_and_estimate_counts(build):
    run = build(goals=1, rounds=2)
    # The robot stops 10 cm apart, and believes so; its estimate is 1 cm off to the left, then 1 cm to the right.
    run.round(0, {0: SE2(0.05, 0.0, 0)}, estimates={0: SE2(0.05, 0.01, 0)})
    run.round(1, {0: SE2(-0.05, 0.0, 0)}, estimates={0: SE2(-0.05, -0.01, 0)})
    metrics = metrics_of(run)
    assert metrics.quantities["precision"].value == pytest.approx(0.05)
    assert metrics.quantities["estimation_precision"].value == pytest.approx(0.01)
    assert metrics.waypoints[0].quantities["estimation_precision"] == pytest.approx(0.01)
    assert metrics.quantities["estimation_precision"].low is None  # two rounds tell no interval


def test_a_constant_error_of_the_estimate_adds_nothing(build):
    run = build(goals=1, rounds=2)
    for number, x in enumerate((0.02, -0.02)):
        run.round(number, {0: SE2(x, 0.0, 0)}, estimates={0: SE2(x + 0.3, 0.2, 0)})
    assert metrics_of(run).quantities["estimation_precision"].value == pytest.approx(0.0, abs=1e-12)


def test_squares_of_control_and_estimation_add_up_to_that_of_precision(build):
    rng = np.random.default_rng(4)
    run = build(goals=60, rounds=20)
    for number in range(20):
        control, estimation = 0.02 * rng.normal(size=(60, 2)), 0.01 * rng.normal(size=(60, 2))
        believed = {goal: SE2(*control[goal], 0.0) for goal in range(60)}
        true = {goal: SE2(*(control[goal] + estimation[goal]), 0.0) for goal in range(60)}
        run.round(number, true, estimates=believed)
    metrics = metrics_of(run)
    E, own = metrics.quantities["precision"].value, metrics.quantities["estimation_precision"]
    assert pytest.approx(metrics.control.spread_m**2 + own.value**2, rel=0.02) == E**2
    assert own.value == pytest.approx(0.01 * np.sqrt(np.pi / 2) * np.sqrt(1 - 1 / 20), rel=0.03)
    assert own.low < own.value < own.high
    assert own.high / own.low < 1.15
