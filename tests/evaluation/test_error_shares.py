import math

import numpy as np
import pytest

from taskslam.evaluation.error_shares import control_error, estimation_error
from taskslam.evaluation.waypoints import position_accuracy, position_precision

GOAL = np.array([1.0, 2.0, math.pi])


def test_control_error_is_the_belief_against_the_goal():
    estimates = np.array([[1.1, 2.0, math.pi - 0.1], [1.0, 2.3, -math.pi + 0.1]])
    error = control_error(estimates, GOAL)
    assert error.position_m == pytest.approx(0.2)
    assert error.heading_rad == pytest.approx(0.1)


def test_estimation_error_is_the_belief_against_the_truth():
    truths = np.array([[1.0, 2.0, 0.0], [1.0, 2.0, 0.0]])
    estimates = truths + np.array([[0.03, 0.04, 0.02], [0.03, 0.04, -0.02]])
    error = estimation_error(estimates, truths)
    assert error.position_m == pytest.approx(0.05)
    assert error.heading_rad == pytest.approx(0.02)
    assert error.spread_m == pytest.approx(0.0, abs=1e-12)


def test_with_a_perfect_estimate_all_the_error_is_control():
    rng = np.random.default_rng(0)
    truths = GOAL + rng.normal(0, 0.05, (5, 3))
    control = control_error(truths, GOAL)
    assert control.position_m == pytest.approx(position_accuracy(truths, GOAL))
    assert control.spread_m == pytest.approx(position_precision(truths))
    assert estimation_error(truths, truths).position_m == 0.0


def test_with_a_perfect_controller_all_the_error_is_estimation():
    rng = np.random.default_rng(0)
    truths = GOAL + rng.normal(0, 0.05, (5, 3))
    believed = np.tile(GOAL, (5, 1))
    estimation = estimation_error(believed, truths)
    assert estimation.position_m == pytest.approx(position_accuracy(truths, GOAL))
    assert estimation.spread_m == pytest.approx(position_precision(truths))
    assert control_error(believed, GOAL).position_m == 0.0


def test_nothing_is_defined_without_a_visit_and_no_spread_with_one():
    none = control_error(np.empty((0, 3)), GOAL)
    assert math.isnan(none.position_m)
    assert math.isnan(none.spread_m)
    one = control_error(GOAL[None] + 0.1, GOAL)
    assert one.heading_rad == pytest.approx(0.1)
    assert math.isnan(one.spread_m)
