import math

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.measurements import LaserScan
from taskslam.navigation.costmap import GlobalCostmap, LocalCostmap
from taskslam.navigation.obstacle_layer import PlacedScan
from taskslam.navigation.settings import CostmapSettings
from taskslam.world.floor_plan import OCCUPIED, UNKNOWN, FloorPlan

SETTINGS = CostmapSettings()
IDENTITY, CORNER = SE2(), SE2(-6.0, -6.0, 0.0)


def scan_of(ranges, angle_min=0.0, increment=0.1):
    return LaserScan(0, np.asarray(ranges, np.float32), angle_min, increment, 0.1, 10.0)


def placed(ranges, pose=IDENTITY, T_map_odom=IDENTITY, **kw):
    return PlacedScan.of(scan_of(ranges, **kw), T_map_odom, pose, SE2())


def open_plan(width=12.0, height=12.0, origin=CORNER):
    return FloorPlan(np.zeros((round(height / 0.1), round(width / 0.1)), np.uint8), 0.1, origin)


@pytest.fixture
def empty():
    return open_plan()


def test_a_hit_marks_both_costmaps(empty):
    local, whole = LocalCostmap(empty, SETTINGS), GlobalCostmap(empty, SETTINGS)
    local.update(placed([2.02]), SE2(), SE2())
    whole.update(placed([2.02]), SE2())
    assert local.cost_at(2.02, 0.0) == 254
    assert whole.cost[whole.cell_of(2.02, 0.0)] == 254


def test_hits_beyond_obstacle_range_mark_nothing_but_clear_up_to_raytrace_range(empty):
    whole = GlobalCostmap(empty, SETTINGS)
    whole.update(placed([4.05]), SE2())
    assert whole.cost[whole.cell_of(4.05, 0.0)] == 254
    whole.update(placed([4.6]), SE2())
    assert whole.cost[whole.cell_of(4.6, 0.0)] == 0
    assert whole.cost[whole.cell_of(4.05, 0.0)] == 0
    whole.update(placed([4.45]), SE2())
    whole.update(placed([8.0]), SE2())
    assert not whole.cost.any()


@pytest.mark.parametrize("nothing", [math.inf, math.nan, 10.0, 0.05])
def test_rays_without_a_valid_hit_neither_mark_nor_clear(empty, nothing):
    local = LocalCostmap(empty, SETTINGS)
    local.update(placed([2.02]), SE2(), SE2())
    local.update(placed([nothing]), SE2(), SE2())
    assert local.cost_at(2.02, 0.0) == 254
    assert (local.layers == 254).sum() == 1


def test_a_ray_past_an_old_mark_clears_it(empty):
    local = LocalCostmap(empty, SETTINGS)
    local.update(placed([1.5]), SE2(), SE2())
    local.update(placed([2.3]), SE2(), SE2())
    assert local.cost_at(1.5, 0.0) == 0
    assert local.cost_at(2.3, 0.0) == 254


def test_marks_stay_in_place_while_the_local_costmap_rolls(empty):
    local = LocalCostmap(empty, SETTINGS)
    local.update(placed([1.52]), SE2(), SE2())
    local.update(None, SE2(), SE2(0.73, -0.41, 0.3))
    assert local.cost_at(1.52, 0.0) == 254
    assert (local.layers == 254).sum() == 1
    local.update(None, SE2(), SE2(-5.0, 0.0, 0.0))
    local.update(None, SE2(), SE2())
    assert local.cost_at(1.52, 0.0) == 0  # rolled out and forgotten


def test_the_cells_under_the_robot_are_freed(empty):
    local = LocalCostmap(empty, SETTINGS)
    local.update(placed([0.3]), SE2(), SE2())
    local.update(None, SE2(), SE2(0.2, 0.0, 0.0))
    assert not local.layers.any()


def test_the_floor_plan_moves_through_the_local_costmap_with_the_estimate():
    plan = open_plan()
    plan.cells[:, 80] = OCCUPIED  # x in [2.0, 2.1)
    local = LocalCostmap(plan, SETTINGS)
    local.update(None, SE2(), SE2())
    assert local.cost_at(2.05, 0.0) == 254
    local.update(None, SE2(0.3, 0.0, 0.0), SE2())
    assert local.cost_at(1.75, 0.0) == 254
    assert local.cost_at(2.08, 0.0) < 254


def test_a_wrong_estimate_draws_a_wall_twice():
    plan = open_plan()
    plan.cells[:, 80] = OCCUPIED
    drift = SE2(0.3, 0.0, 0.0)  # the robot believes itself 0.3 m further on than it is
    local, whole = LocalCostmap(plan, SETTINGS), GlobalCostmap(plan, SETTINGS)
    seen = placed([2.0], T_map_odom=drift)
    local.update(seen, drift, SE2())
    whole.update(seen, drift)
    assert local.cost_at(1.75, 0.0) == 254  # the plan's wall, by the estimate
    assert local.cost_at(2.02, 0.0) == 254  # the same wall, as the laser saw it
    assert whole.cost[whole.cell_of(2.05, 0.0)] == 254
    assert whole.cost[whole.cell_of(2.32, 0.0)] == 254


def test_a_rotated_plan_origin_is_respected():
    plan = open_plan(origin=SE2(6.0, -6.0, math.pi / 2))
    whole = GlobalCostmap(plan, SETTINGS)
    whole.update(placed([2.02], pose=SE2(1.0, 1.0, math.pi / 2)), SE2(1.0, 1.0, math.pi / 2))
    assert whole.cost[tuple(plan.cells_of(np.array([[1.0, 3.02]]))[0])] == 254


def test_unknown_cells_are_free_unless_told_otherwise():
    plan = open_plan()
    plan.cells[60, 70] = UNKNOWN
    assert GlobalCostmap(plan, SETTINGS).cost[60, 70] == 0
    strict = CostmapSettings(unknown_is_free=False)
    assert GlobalCostmap(plan, strict).cost[60, 70] == 254


def test_reset_leaves_the_floor_plan_alone():
    plan = open_plan()
    plan.cells[:, 80] = OCCUPIED
    whole = GlobalCostmap(plan, SETTINGS)
    before = whole.cost.copy()
    whole.update(placed([1.0, 1.5, 1.2]), SE2())
    assert (whole.cost != before).any()
    whole.reset()
    np.testing.assert_array_equal(whole.cost, before)
    whole.update(None, SE2())
    np.testing.assert_array_equal(whole.cost, before)


def test_obstacles_are_surface_cells_and_not_far_behind():
    plan = open_plan()
    plan.cells[50:70, 75:90] = OCCUPIED  # x 1.5 .. 3.0 ahead
    plan.cells[50:70, 40:45] = OCCUPIED  # x -2.0 .. -1.5 behind
    local = LocalCostmap(plan, SETTINGS)
    local.update(None, SE2(), SE2())
    points = local.obstacles(SE2(), behind=1.0)
    assert (points[:, 0] > 0).all()
    interior = (points[:, 0] > 1.6) & (points[:, 0] < 2.4) & (np.abs(points[:, 1]) < 0.9)
    assert len(points) > 0
    assert not interior.any()
    assert len(local.obstacles(SE2(), behind=3.0)) > len(points)
