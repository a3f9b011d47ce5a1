"""What a scan does to the cells, and how the map grows."""

import math

import numpy as np
import pytest

from taskslam.slam.hector.occupancy_grid import LIMIT, OccupancyGrid

FREE, OCCUPIED = math.log(0.4 / 0.6), math.log(0.9 / 0.1)
ORIGIN = np.zeros(3)


def inserted(points, sensor=(0.0, 0.0), pose=ORIGIN, times=1, resolution=0.1) -> OccupancyGrid:
    grid = OccupancyGrid(resolution, 100.0)
    for _ in range(times):
        grid.insert(np.array(points, float), np.array(sensor, float), np.array(pose, float), FREE, OCCUPIED)
    return grid


def at(grid: OccupancyGrid, x: float, y: float) -> float:
    column, row = np.floor((np.array([x, y]) - grid.origin) / grid.resolution).astype(int)
    return float(grid.log_odds[row, column])


def test_a_ray_frees_its_cells_and_occupies_the_one_that_it_hits() -> None:
    grid = inserted([(1.05, 0.05)], sensor=(0.05, 0.05))
    for x in np.arange(0.05, 1.0, 0.1):
        assert at(grid, x, 0.05) == pytest.approx(FREE)
    assert at(grid, 1.05, 0.05) == pytest.approx(OCCUPIED)
    assert np.count_nonzero(grid.log_odds) == 11


def test_a_cell_counts_once_in_a_scan_however_many_rays_meet_it() -> None:
    fan = [(1.0 + 0.001 * k, 0.05) for k in range(50)]
    grid = inserted(fan, sensor=(0.05, 0.05))
    assert at(grid, 1.04, 0.05) == pytest.approx(OCCUPIED)
    assert at(grid, 0.05, 0.05) == pytest.approx(FREE)


@pytest.mark.parametrize("near_first", [True, False])
def test_a_hit_outweighs_the_rays_that_pass(near_first: bool) -> None:
    near, far = (0.55, 0.05), (1.55, 0.05)
    grid = inserted([near, far] if near_first else [far, near], sensor=(0.05, 0.05))
    assert at(grid, *near) == pytest.approx(OCCUPIED)
    assert at(grid, 1.05, 0.05) == pytest.approx(FREE)


def test_scans_add_up_and_stay_within_limits() -> None:
    assert at(inserted([(1.05, 0.05)], times=3), 1.05, 0.05) == pytest.approx(3 * OCCUPIED, rel=1e-6)
    many = inserted([(1.05, 0.05)], times=200)
    assert many.log_odds.max() == LIMIT
    assert many.log_odds.min() == -LIMIT


def test_points_are_placed_by_the_pose() -> None:
    grid = inserted([(1.0, 0.0)], pose=(2.0, 3.0, np.pi / 2))
    assert at(grid, 2.0, 4.0) == pytest.approx(OCCUPIED)


def test_growing_keeps_what_is_there() -> None:
    grid = inserted([(1.05, 0.05)], sensor=(0.05, 0.05))
    small = grid.log_odds.shape
    far = np.array([-30.0, 20.0, 0.0])
    grid.insert(np.array([[1.05, 0.05]]), np.array([0.05, 0.05]), far, FREE, OCCUPIED)
    assert grid.log_odds.shape > small
    assert at(grid, 1.05, 0.05) == pytest.approx(OCCUPIED)
    assert at(grid, -28.95, 20.05) == pytest.approx(OCCUPIED)
    assert np.count_nonzero(grid.log_odds) == 22


def test_the_map_grows_no_further_than_allowed() -> None:
    grid = OccupancyGrid(0.1, 20.0)
    for x in (0.0, 9.0, 1000.0, -1000.0):
        grid.insert(np.array([[5.0, 5.0], [0.5, 0.0]]), np.zeros(2), np.array([x, 0.0, 0.0]), FREE, OCCUPIED)
    assert max(grid.log_odds.shape) * grid.resolution <= 20.0 + 2 * 12.8
    assert at(grid, 9.55, 0.05) != 0.0
