import math
import re

import numpy as np
import pytest

from taskslam.evaluation.metrics_file import ErrorShare, Orientation, Position, Visit, WaypointMetrics
from taskslam.geometry import SE2
from taskslam.report.page.arrivals_figure import arrivals_figures
from taskslam.report.units import Units
from taskslam.task import GoalTolerance

NONE = ErrorShare(position_m=None, heading_rad=None, spread_m=None)


UNITS = Units(0.3, 80.0)
TARGET = SE2(3.0, -2.0, 2.1)


def waypoint(offsets, goal=0):
    """A waypoint with true arrivals at these offsets in the goal's frame (x ahead, y left)."""
    truths = [TARGET @ offset for offset in offsets]
    mean = np.mean([truth.array()[:2] for truth in truths], axis=0) if truths else None
    return WaypointMetrics(
        goal=goal,
        target=(TARGET.x, TARGET.y, TARGET.theta),
        visits=len(truths),
        rounds=5,
        complete=len(truths) == 5,
        position=Position(precision_m=0.02 if truths else None, accuracy_m=0.05 if truths else None),
        precision_rms_m=None,
        orientation=Orientation(precision_rad=None, accuracy_rad=None),
        mean_pose=None if mean is None else (float(mean[0]), float(mean[1]), TARGET.theta),
        control=NONE,
        estimation=NONE,
        arrivals=tuple(
            Visit(round=n, t_s=0.0, truth=(t.x, t.y, t.theta), estimate=None, odometry=None)
            for n, t in enumerate(truths)
        ),
    )


def dots(markup):
    return [(float(x), float(y)) for x, y in re.findall(r'<circle cx="([-\d.]+)" cy="([-\d.]+)" r="3.4"', str(markup))]


def test_ahead_of_the_goal_is_up_and_left_is_left():
    (panel,) = arrivals_figures(
        [waypoint([SE2(0.02, 0, 0), SE2(-0.02, 0, 0), SE2(0, 0.02, 0)])], GoalTolerance(), UNITS
    )
    ahead, behind, left = dots(panel)
    assert ahead[1] < behind[1]
    assert ahead[0] == pytest.approx(behind[0], abs=0.02)
    assert left[0] < ahead[0]


def test_the_scale_bar_is_true():
    (panel,) = arrivals_figures([waypoint([SE2(0.02, 0, 0), SE2(-0.02, 0, 0)])], GoalTolerance(), UNITS)
    label = re.search(r">(\d+) cm</text>", str(panel)).group(1)
    bar = re.search(r'<line x1="10" y1="([\d.]+)" x2="([\d.]+)" y2="\1"', str(panel))
    pixels_per_cm = (float(bar.group(2)) - 10) / float(label)
    (_, y1), (_, y2) = dots(panel)
    assert abs(y1 - y2) == pytest.approx(4 * pixels_per_cm, abs=0.05)


def test_panels_share_a_scale_unless_one_scatters_further():
    close = [waypoint([SE2(0.01, 0, 0), SE2(-0.01, 0, 0)], goal=n) for n in range(4)]
    wide = waypoint([SE2(2, 0, 0), SE2(-2, 0, 0)], goal=4)
    bars = [
        re.search(r">(\d+ [cm]?m)</text>", str(panel)).group(1)
        for panel in arrivals_figures([*close, wide], GoalTolerance(), UNITS)
    ]
    assert bars[:4] == ["5 mm"] * 4
    assert bars[4] == "1 m"


def test_every_arrival_is_inside_its_panel():
    rng = np.random.default_rng(0)
    for size in (0.001, 0.03, 0.4, 6.0, 80.0):
        offsets = [SE2(*rng.uniform(-size, size, 2), 0.0) for _ in range(5)]
        (panel,) = arrivals_figures([waypoint(offsets)], GoalTolerance(), UNITS)
        assert len(dots(panel)) == 5
        assert all(0 <= x <= 200 and 0 <= y <= 200 for x, y in dots(panel))


def test_heading_ticks_point_where_the_robot_did():
    (panel,) = arrivals_figures([waypoint([SE2(0, 0, math.pi / 2), SE2(0, 0, math.pi / 2)])], GoalTolerance(), UNITS)
    line = re.search(
        r'<line x1="([-\d.]+)" y1="([-\d.]+)" x2="([-\d.]+)" y2="([-\d.]+)" stroke="var\(--blue\)"', str(panel)
    )
    x1, y1, x2, y2 = map(float, line.groups())
    assert x2 < x1
    assert y2 == pytest.approx(y1, abs=0.02)


def test_a_waypoint_never_reached_says_so():
    (panel,) = arrivals_figures([waypoint([])], GoalTolerance(), UNITS)
    assert "never reached" in str(panel)
    assert dots(panel) == []


def test_a_single_arrival_is_shown_against_its_goal():
    (panel,) = arrivals_figures([waypoint([SE2(0.03, 0, 0)])], GoalTolerance(), UNITS)
    ((x, y),) = dots(panel)
    assert x == pytest.approx(100)
    assert 0 < y < 99
