import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.geometry import SE2
from taskslam.navigation.costmap import GlobalCostmap
from taskslam.navigation.global_planner import plan_path
from taskslam.navigation.settings import CostmapSettings, GlobalPlannerSettings
from taskslam.world.floor_plan import OCCUPIED, FloorPlan

SETTINGS = GlobalPlannerSettings()


def length(path):
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def plan_in(plan, start, goal):
    costmap = GlobalCostmap(plan, CostmapSettings())
    return costmap, plan_path(costmap, start, goal, SETTINGS)


def test_in_the_open_the_path_is_nearly_straight(make_plan):
    _, path = plan_in(make_plan(10, 10, resolution=0.1), SE2(2, 2), SE2(8, 5))
    assert tuple(path[0]) == (2, 2)
    assert tuple(path[-1]) == (8, 5)
    assert length(path) < 1.03 * math.hypot(6, 3)  # a grid path without the gradient would be 11 % longer
    assert np.hypot(*np.diff(path, axis=0).T).max() < 0.16


def test_it_goes_through_a_door_of_90_cm(make_plan):
    plan = make_plan(8, 6, [(4.0, 0.0, 4.2, 2.5), (4.0, 3.4, 4.2, 6.0)], 0.1)
    costmap, path = plan_in(plan, SE2(2, 1), SE2(6, 5))
    crossing = path[np.argmin(np.abs(path[:, 0] - 4.1))]
    assert 2.7 < crossing[1] < 3.2
    assert max(costmap.cost[costmap.cell_of(*p)] for p in path) < 253


def test_no_way_means_no_plan(make_plan):
    closed = make_plan(8, 6, [(4.0, 0.0, 4.2, 6.0)], 0.1)
    assert plan_in(closed, SE2(2, 3), SE2(6, 3))[1] is None
    assert plan_in(closed, SE2(2, 3), SE2(4.1, 3))[1] is None
    assert plan_in(closed, SE2(2, 3), SE2(60, 3))[1] is None
    too_narrow = make_plan(8, 6, [(4.0, 0.0, 4.2, 2.8), (4.0, 3.2, 4.2, 6.0)], 0.1)
    assert plan_in(too_narrow, SE2(2, 3), SE2(6, 3))[1] is None


def test_the_start_cell_counts_as_free(make_plan):
    plan = make_plan(6, 6, [(2.5, 2.5, 2.6, 2.6)], 0.1)
    # 0.2 m beside the pillar: closed for everyone but the robot that already stands there
    _, path = plan_in(plan, SE2(2.75, 2.55), SE2(5, 5))
    assert path is not None


def test_start_and_goal_in_one_cell(make_plan):
    _, path = plan_in(make_plan(6, 6, resolution=0.1), SE2(3.01, 3.01), SE2(3.04, 3.03))
    np.testing.assert_allclose(path, [[3.01, 3.01], [3.04, 3.03]])


@given(st.integers(0, 500))
def test_a_path_joins_its_ends_without_jumps_or_closed_cells(seed):
    random = np.random.default_rng(seed)
    cells = np.where(random.random((60, 60)) < 0.012, OCCUPIED, 0).astype(np.uint8)
    plan = FloorPlan(cells, 0.1, SE2(-1.0, 2.0, 0.4))
    ends = plan.points_of(random.integers(5, 55, (2, 2)))
    costmap = GlobalCostmap(plan, CostmapSettings())
    path = plan_path(costmap, SE2(*ends[0]), SE2(*ends[1]), SETTINGS)
    goal_cell = costmap.cell_of(*ends[1])
    if costmap.cost[goal_cell] >= 252 and goal_cell != costmap.cell_of(*ends[0]):
        assert path is None
    if path is None:
        return
    steps = np.hypot(*np.diff(path, axis=0).T)
    assert steps.max() <= 0.1 * math.sqrt(2) + 0.101
    assert length(path) >= np.hypot(*(ends[1] - ends[0])) - 1e-9
    inner = [costmap.cost[costmap.cell_of(*p)] for p in path if np.hypot(*(p - ends[0])) > 0.2]
    assert all(c < 252 for c in inner)
    assert tuple(path[0]) == pytest.approx(tuple(ends[0]))
