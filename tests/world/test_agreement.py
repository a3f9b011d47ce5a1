import math

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.world.agreement import agreement
from taskslam.world.floor_plan import FREE, OCCUPIED, UNKNOWN, FloorPlan


def corridor(offset: float = 0.0, resolution: float = 0.1) -> FloorPlan:
    """Two walls 2 m apart along x, drawn with `offset` m of error in y."""
    cells = np.full((round(2.4 / resolution), round(5.0 / resolution)), FREE, np.uint8)
    cells[0] = cells[-1] = OCCUPIED
    return FloorPlan(cells, resolution, SE2(0.0, offset))


def test_a_plan_agrees_with_itself():
    a = agreement(corridor(), corridor())
    assert (a.occupied_a, a.occupied_b, a.free_a, a.free_b) == (1.0, 1.0, 1.0, 1.0)


def test_a_shift_beyond_the_tolerance_is_seen():
    assert agreement(corridor(), corridor(0.1)).occupied_a == 1.0
    assert agreement(corridor(), corridor(0.2)).occupied_a == 0.0
    assert agreement(corridor(), corridor(0.2), tolerance_m=0.2).occupied_a == 1.0


def test_an_obstacle_that_only_one_plan_has_counts_on_that_side_only():
    plan, more = corridor(), corridor()
    more.cells[10:12, 20:24] = OCCUPIED
    a = agreement(more, plan)
    assert a.occupied_a == pytest.approx(100 / 108)
    assert a.occupied_b == 1.0
    assert a.free_a == 1.0
    assert a.free_b == pytest.approx(1 - 8 / (22 * 50))


def test_plans_of_different_grids_compare_in_the_map_frame():
    fine = corridor(resolution=0.05)
    turned = FloorPlan(np.ascontiguousarray(np.rot90(fine.cells)), 0.05, SE2(0.0, 2.4, -math.pi / 2))
    assert agreement(turned, fine).free_a > 0.9
    assert agreement(turned, fine).occupied_a == 1.0
    assert agreement(corridor(), fine).occupied_b == 1.0


def test_unknown_is_neither():
    empty = FloorPlan(np.full((3, 3), UNKNOWN, np.uint8), 0.1, SE2())
    a = agreement(empty, corridor())
    assert math.isnan(a.occupied_a)
    assert math.isnan(a.free_a)
    assert a.occupied_b == 0.0
    assert a.free_b == 0.0
