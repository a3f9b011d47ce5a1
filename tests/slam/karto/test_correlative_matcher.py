import numpy as np
import pytest

from taskslam.slam.karto.correlation_grid import CorrelationGrid
from taskslam.slam.karto.correlative_matcher import WORST_VARIANCE, CorrelativeMatcher
from taskslam.slam.karto.scan_points import ScanPoints
from taskslam.slam.karto.settings import KartoSettings

SETTINGS = KartoSettings()


@pytest.fixture(scope="module")
def matcher() -> CorrelativeMatcher:
    return CorrelativeMatcher(0.5, 0.01, 0.1, coarse_step=4, settings=SETTINGS)


def world_points(scan: ScanPoints, pose: np.ndarray) -> np.ndarray:
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return scan.points @ np.array([[c, s], [-s, c]]) + pose[:2]


def value_at(grid: CorrelationGrid, x: float, y: float) -> int:
    column, row = np.floor((np.array([x, y]) - grid.origin) / grid.resolution).astype(int)
    return int(grid.values[row, column])


def test_a_cell_tells_its_distance_to_the_nearest_hit() -> None:
    grid = CorrelationGrid(0.01, 0.1, 2.0)
    grid.fill(np.array([[0.505, 0.505]]), np.zeros(2))
    assert value_at(grid, 0.505, 0.505) == 100
    assert value_at(grid, 0.605, 0.505) == round(100 * np.exp(-0.5))
    assert value_at(grid, 0.505, 0.305) == round(100 * np.exp(-2.0))
    assert value_at(grid, 0.505, 0.285) == 0


def test_of_two_hits_the_nearer_one_counts() -> None:
    grid = CorrelationGrid(0.01, 0.1, 2.0)
    grid.fill(np.array([[0.005, 0.005], [0.155, 0.005]]), np.zeros(2))
    assert value_at(grid, 0.105, 0.005) == round(100 * np.exp(-0.5 * 0.25))


def test_hits_beyond_the_grid_and_earlier_fills_leave_no_trace() -> None:
    grid = CorrelationGrid(0.05, 0.03, 1.0)
    grid.fill(np.array([[0.0, 0.0]]), np.zeros(2))
    grid.fill(np.array([[50.0, 0.0], [-50.0, 3.0]]), np.zeros(2))
    assert not grid.values.any()


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (0.11, -0.07, 0.05), (-0.2, 0.15, -0.3), (0.23, 0.23, 0.2)])
def test_a_known_offset_is_found_within_a_cell(matcher, scan_at, offset) -> None:
    reference, query = np.array([2.0, 2.0, 0.3]), np.array([2.3, 1.8, 0.1])
    matcher.show(world_points(scan_at(*reference, noise=0.01), reference), query)
    found = matcher.match(scan_at(*query, noise=0.01, seed=1), query + offset, penalize=True)
    assert np.abs(found.pose - query)[:2].max() < 0.015
    assert abs(found.pose[2] - query[2]) < 0.006
    assert found.response > 0.9


def test_penalty_decides_where_the_walls_leave_a_direction_open(matcher, scan_at) -> None:
    corridor = np.array([(-50.0, 0.0, 50.0, 0.0), (-50.0, 2.0, 50.0, 2.0)])
    pose = np.array([0.0, 1.0, 0.0])
    scan = scan_at(*pose, where=corridor)
    matcher.show(world_points(scan_at(0.4, 1.0, 0.0, where=corridor), np.array([0.4, 1.0, 0.0])), pose)
    predicted = pose + np.array([0.0, 0.1, 0.0])
    found = matcher.match(scan, predicted, penalize=True)
    assert abs(found.pose[1] - 1.0) < 0.015  # across: told by the walls
    assert abs(found.pose[0]) < 0.05  # along: as predicted
    assert found.covariance[0, 0] > 5 * found.covariance[1, 1]


def test_a_scan_of_another_room_gets_a_low_response(matcher, scan_at) -> None:
    small = np.array([(0.0, 0.0, 1.5, 0.0), (1.5, 0.0, 1.5, 1.5), (1.5, 1.5, 0.0, 1.5), (0.0, 1.5, 0.0, 0.0)])
    pose = np.array([3.0, 2.0, 0.0])
    matcher.show(world_points(scan_at(*pose), pose), pose)
    assert matcher.match(scan_at(0.75, 0.75, 0.0, where=small), pose, penalize=True).response < 0.4


def test_no_reference_gives_no_response_and_no_knowledge(matcher, scan_at) -> None:
    matcher.show(np.zeros((0, 2)), np.zeros(3))
    found = matcher.match(scan_at(2.0, 2.0, 0.0), np.zeros(3), penalize=False)
    assert found.response == 0.0
    assert found.covariance[0, 0] == WORST_VARIANCE
    assert np.isfinite(found.pose).all()


def test_response_expansion_finds_a_heading_outside_the_window(scan_at) -> None:
    """A lone post: at the predicted heading no hit of the scan meets it, so the search is widened."""
    post = np.stack([np.full(30, 3.0), np.linspace(-0.05, 0.05, 30)], axis=1)
    scan = ScanPoints(post, np.zeros_like(post), np.zeros(2))
    turned = np.array([0.0, 0.0, 0.6])
    for expand, low, high in ((True, 0.9, 1.0), (False, 0.0, 0.0)):
        settings = KartoSettings(use_response_expansion=expand)
        matcher = CorrelativeMatcher(0.5, 0.01, 0.1, coarse_step=4, settings=settings)
        matcher.show(world_points(scan, turned), np.zeros(3))
        assert low <= matcher.match(scan, np.zeros(3), penalize=False).response <= high
