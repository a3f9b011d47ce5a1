import re

import numpy as np
import pytest

from taskslam.evaluation import run_metrics
from taskslam.geometry import SE2
from taskslam.record import load_run
from taskslam.report.page.tour_figure import tour_figure
from taskslam.report.tracks import Tracks
from taskslam.world import FloorPlan
from taskslam.world.floor_plan import FREE


def circles(markup):
    """Centres of the waypoint discs, in the order of the goals."""
    return np.array(
        [[float(x), float(y)] for x, y in re.findall(r'<circle cx="([-\d.]+)" cy="([-\d.]+)" r="11"', markup)]
    )


@pytest.mark.parametrize("yaw", [0.0, 0.4, -2.0])
def test_the_floor_plan_lies_where_the_waypoints_say(make_run, yaw):
    """A goal's cell, taken through the picture's own transform, must fall on the goal's disc."""
    record = load_run(make_run())
    plan = FloorPlan(np.full((200, 200), FREE, dtype=np.uint8), 0.1, SE2(-10.0, -10.0, yaw))
    markup = str(tour_figure(record, run_metrics(record, "run"), plan, Tracks(record)))
    a, b, c, d, e, f = map(float, re.search(r"matrix\(([^)]+)\)", markup).group(1).split())
    discs = circles(markup)
    for goal, disc in zip(record.manifest.goals, discs, strict=True):
        local = plan.origin.inverse() @ goal
        u, v = local.x / plan.resolution, plan.cells.shape[0] - local.y / plan.resolution
        assert disc == pytest.approx([a * u + c * v + e, b * u + d * v + f], abs=0.05)


def test_up_in_the_drawing_is_up_in_the_map(make_run):
    record = load_run(make_run())
    first, second, third = circles(str(tour_figure(record, run_metrics(record, "run"), None, Tracks(record))))
    assert second[0] > first[0]
    assert second[1] == pytest.approx(first[1])
    assert third[1] < second[1]


def test_every_round_is_drawn_true_and_estimated(make_run):
    record = load_run(make_run(rounds=4))
    markup = str(tour_figure(record, run_metrics(record, "run"), None, Tracks(record)))
    tracks = re.findall(r'<polyline points="[^"]+" fill="none"/>', markup)  # their colour is their group's
    assert len(tracks) == 2 * 4


def test_a_failure_is_marked_and_a_missed_waypoint_is_hollow(make_run):
    record = load_run(make_run(failed=True))
    markup = str(tour_figure(record, run_metrics(record, "run"), None, Tracks(record)))
    fills = re.findall(r'r="11" fill="([^"]+)"', markup)
    assert len(set(fills)) == 2
    assert fills[0] == fills[1] != fills[2]
    assert "var(--vermilion)" in markup
