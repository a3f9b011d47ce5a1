import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS
from taskslam.navigation.costmap import LocalCostmap
from taskslam.navigation.homotopy import same_class
from taskslam.navigation.local_planner import ControlRequest
from taskslam.navigation.settings import CostmapSettings, TebSettings
from taskslam.navigation.teb import TebPlanner
from taskslam.navigation.velocity_smoother import Velocity
from taskslam.world.floor_plan import OCCUPIED, FloorPlan

SETTINGS = TebSettings()
HORIZON = 2.125


def request_in(plan, pose, goal, path=None, velocity=Velocity(), now=0):  # noqa: B008
    local = LocalCostmap(plan, CostmapSettings())
    local.update(None, SE2(), pose)
    if path is None:
        count = max(int(pose.distance_to(goal) / 0.05), 2)
        path = np.linspace((pose.x, pose.y), (goal.x, goal.y), count)
    return ControlRequest(now, pose, velocity, path, goal, local)


def end_of(planner):
    return SE2(*planner.best.poses()[-1])


def test_a_far_goal_is_cut_at_the_horizon_with_the_heading_of_the_plan(make_plan):
    planner = TebPlanner(SETTINGS)
    pose, goal = SE2(2, 2, 0.6), SE2(6, 5, -2.0)
    assert planner.command(request_in(make_plan(10, 8), pose, goal)) is not None
    end = end_of(planner)
    assert HORIZON - 0.06 < end.distance_to(pose) <= HORIZON
    assert end.theta == pytest.approx(math.atan2(3, 4))


def test_within_the_horizon_the_goal_has_its_own_heading(make_plan):
    planner, goal = TebPlanner(SETTINGS), SE2(3.5, 3, -2.0)
    planner.command(request_in(make_plan(10, 8), SE2(2, 2, 0), goal))
    end = end_of(planner)
    assert (end.x, end.y) == pytest.approx((goal.x, goal.y))
    assert math.cos(end.theta - goal.theta) == pytest.approx(1.0)


def test_it_speeds_up_to_the_limit_and_no_further(make_plan):
    planner, plan = TebPlanner(SETTINGS), make_plan(10, 8)
    slow = planner.command(request_in(plan, SE2(2, 2, 0), SE2(8, 2, 0)))
    planner.reset()
    fast = planner.command(request_in(plan, SE2(2, 2, 0), SE2(8, 2, 0), velocity=Velocity(0.3, 0.0)))
    assert 0.15 < slow.linear < fast.linear == 0.3
    assert abs(slow.angular) < 1e-2


def test_a_robot_inside_an_obstacle_has_no_command_and_then_looks_less_far(make_plan):
    planner, pose, goal = TebPlanner(SETTINGS), SE2(2, 2, 0), SE2(8, 2, 0)
    stuck = make_plan(10, 8, [(2.05, 1.9, 2.15, 2.1)])
    assert planner.command(request_in(stuck, pose, goal)) is None
    assert planner.best is None
    planner.command(request_in(make_plan(10, 8), pose, goal, now=5 * NANOSECONDS))
    assert end_of(planner).distance_to(pose) < 0.55 * HORIZON
    planner.command(request_in(make_plan(10, 8), pose, goal, now=11 * NANOSECONDS))
    assert end_of(planner).distance_to(pose) > 0.95 * HORIZON


def test_of_two_ways_past_a_post_the_clear_one_is_taken(make_plan):
    # the global path passes close between post and wall; the band on the other side is free
    plan = make_plan(10, 8, [(3.0, 2.0, 3.1, 2.2), (2.0, 2.7, 4.5, 2.8)])
    path = np.array([(2.0, 2.1), (2.6, 2.4), (3.4, 2.4), (4.1, 2.1)])
    path = np.vstack([np.linspace(a, b, 12) for a, b in itertools.pairwise(path)])
    planner, request = TebPlanner(SETTINGS), request_in(plan, SE2(2, 2.1, 0), SE2(4.1, 2.1, 0), path)
    for k in range(5):
        assert planner.command(replace(request, now=k * NANOSECONDS // 5)) is not None
    poses = planner.best.poses()
    assert poses[np.argmin(np.abs(poses[:, 0] - 3.05)), 1] < 2.0


def test_it_stays_with_its_way_when_the_plan_changes_sides(make_plan):
    plan = make_plan(10, 8, [(3.0, 3.9, 3.2, 4.1)])
    above = np.vstack([np.linspace((2, 4), (3.1, 4.5), 20), np.linspace((3.1, 4.5), (4.1, 4), 20)])
    below = above * (1, -1) + (0, 8)
    planner = TebPlanner(SETTINGS)
    planner.command(request_in(plan, SE2(2, 4, 0), SE2(4.1, 4, 0), above))
    first = planner.best.signature
    assert planner.command(request_in(plan, SE2(2, 4, 0), SE2(4.1, 4, 0), below)) is not None
    assert same_class(planner.best.signature, first)
    assert len(planner.bands) == 2


def test_a_goal_elsewhere_starts_a_new_band(make_plan):
    planner, plan = TebPlanner(SETTINGS), make_plan(10, 8)
    planner.command(request_in(plan, SE2(4, 4, 0), SE2(5.5, 4, 0)))
    before = planner.best
    planner.command(request_in(plan, SE2(4, 4, 0), SE2(5.6, 4.1, 0)))
    assert planner.best is before
    planner.command(request_in(plan, SE2(4, 4, 0), SE2(2.6, 4.1, 0)))
    assert planner.best is not before
    assert end_of(planner).x == pytest.approx(2.6)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.floats(-0.15, 0.3), st.floats(-1.5, 1.5))
def test_in_any_clutter_commands_are_within_the_limits_and_bands_start_at_the_robot(seed, linear, angular):
    random = np.random.default_rng(seed)
    cells = np.where(random.random((80, 80)) < random.uniform(0, 0.04), OCCUPIED, 0).astype(np.uint8)
    plan = FloorPlan(cells, 0.1, SE2())
    x, y, gx, gy = random.uniform(1, 7, 4)
    planner = TebPlanner(SETTINGS)
    pose = SE2(x, y, random.uniform(-3.1, 3.1))
    for k in range(3):
        request = request_in(plan, pose, SE2(gx, gy, random.uniform(-3.1, 3.1)), None, Velocity(linear, angular), k)
        command = planner.command(request)
        if command is None:
            assert planner.best is None
            continue
        assert -0.15 <= command.linear <= 0.3
        assert abs(command.angular) <= 1.5
        np.testing.assert_array_equal(planner.best.poses()[0], pose.array())
        assert 1 <= len(planner.bands) <= SETTINGS.max_classes
