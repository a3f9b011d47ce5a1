import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.geometry import SE2
from taskslam.world.floor_plan import FREE, OCCUPIED, UNKNOWN, FloorPlan

AT_1_2 = SE2(1.0, 2.0, 0.0)


def plan(origin=AT_1_2) -> FloorPlan:
    cells = np.full((3, 4), FREE, np.uint8)
    cells[0, 3] = OCCUPIED
    return FloorPlan(cells, 0.1, origin)


def test_row_zero_is_the_lowest_y_and_column_zero_the_lowest_x():
    assert plan().cells_of(np.array([[1.05, 2.05], [1.35, 2.25]])).tolist() == [[0, 0], [2, 3]]
    assert plan().at(1.35, 2.05) == OCCUPIED
    assert plan().at(1.35, 2.15) == FREE


def test_outside_the_grid_is_unknown():
    for x, y in [(0.99, 2.05), (1.41, 2.05), (1.05, 1.99), (1.05, 2.31)]:
        assert plan().at(x, y) == UNKNOWN


def test_the_origin_may_be_turned():
    turned = plan(SE2(1.0, 2.0, math.pi / 2))
    assert turned.at(0.95, 2.35) == OCCUPIED
    assert turned.points_of(np.array([[0, 3]])) == pytest.approx(np.array([[0.95, 2.35]]))


@given(
    st.floats(-50, 50), st.floats(-50, 50), st.floats(-4, 4), st.sampled_from([0.02, 0.05, 0.1, 1.0]),
    st.integers(-500, 500), st.integers(-500, 500),
)  # fmt: skip
def test_the_centre_of_a_cell_lies_in_that_cell(x, y, theta, resolution, row, column):
    grid = FloorPlan(np.zeros((1, 1), np.uint8), resolution, SE2(x, y, theta))
    cell = np.array([[row, column]])
    assert np.array_equal(grid.cells_of(grid.points_of(cell)), cell)
