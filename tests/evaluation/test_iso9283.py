import math

import numpy as np
import pytest

from taskslam.evaluation.iso9283 import iso9283

VISITS = np.array([(0, 0, 0), (0.1, 0, 0.1), (0, 0.1, -0.1), (-0.1, 0, 0.05), (0, -0.1, -0.05)])
GOAL = np.array([0.05, 0, 0.02])


def test_golden_values_worked_out_by_hand():
    found = iso9283(VISITS, GOAL)
    # l = 0, .1, .1, .1, .1: mean .08, S = sqrt((.08^2 + 4 * .02^2) / 4) = sqrt(.002)
    assert found.pose_repeatability_m == pytest.approx(0.08 + 3 * math.sqrt(0.002))
    assert found.pose_accuracy_m == pytest.approx(0.05)
    assert found.pose_repeatability_rad == pytest.approx(3 * math.sqrt((0.1**2 + 0.1**2 + 0.05**2 + 0.05**2) / 4))
    assert found.pose_accuracy_rad == pytest.approx(0.02)


def test_missed_visits_are_left_out():
    with_gap = np.insert(VISITS, 2, np.nan, axis=0)
    assert iso9283(with_gap, GOAL).pose_repeatability_m == pytest.approx(iso9283(VISITS, GOAL).pose_repeatability_m)


def test_one_visit_has_accuracy_and_no_repeatability():
    found = iso9283(VISITS[1:2], GOAL)
    assert found.pose_accuracy_m == pytest.approx(0.05)
    assert math.isnan(found.pose_repeatability_m)
    assert math.isnan(found.pose_repeatability_rad)


def test_many_waypoints_at_once():
    found = iso9283(np.stack([VISITS, 2 * VISITS]), np.stack([GOAL, 2 * GOAL]))
    assert found.pose_accuracy_m == pytest.approx([0.05, 0.1])
    assert found.pose_repeatability_m[1] == pytest.approx(2 * found.pose_repeatability_m[0])
