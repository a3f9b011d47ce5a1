"""The voxel map: which points it keeps, and its neighbours against an exact search over all points."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from taskslam.slam.fast_lio2.voxel_map import VoxelMap, nearest


def neighbours(kept: VoxelMap, query, count: int, farthest: float):
    slots, squares = np.empty(count, np.int64), np.empty(count)
    found = nearest(kept.keys, kept.points, kept.size, *query, farthest, slots, squares)
    return kept.points[slots[:found]], squares[:found]


@pytest.mark.parametrize("size", [0.2, 0.5])
@pytest.mark.parametrize("farthest", [0.3, 1.0, 5.0**0.5])
def test_neighbours_equal_an_exact_search(size, farthest) -> None:
    """Walls, clutter and loose points; queries on them, beside them and far from all."""
    dice = np.random.default_rng(3)
    wall = dice.uniform([-6, -3, -1], [6, -2.98, 2], (4000, 3))
    clutter = dice.normal(0, 1.5, (1500, 3))
    loose = dice.uniform(-15, 15, (60, 3))
    kept = VoxelMap(size, keep_nearest=True)
    kept.insert(np.vstack([wall, clutter, loose]))
    points = kept.all_points()
    tree = cKDTree(points)
    queries = np.vstack([wall[::40], clutter[::15], loose, dice.uniform(-20, 20, (200, 3))])
    counts = set()
    for query in queries:
        found, squares = neighbours(kept, query, 5, farthest)
        expected, _ = tree.query(query, 5)
        expected = expected[expected <= farthest]
        counts.add(len(expected))
        np.testing.assert_allclose(np.sqrt(squares), expected, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(found - query, axis=1), expected, atol=1e-12)
    assert 0 in counts
    assert 5 in counts or farthest < size


def test_a_voxel_keeps_the_point_nearest_to_its_centre_or_the_first() -> None:
    points = np.array([[0.1, 0.1, 0.1], [0.26, 0.24, 0.2], [0.4, 0.4, 0.4], [-0.1, 0.1, 0.1]])
    for keep_nearest, expected in ((True, points[1]), (False, points[0])):
        kept = VoxelMap(0.5, keep_nearest)
        kept.insert(points)
        assert len(kept) == 2
        np.testing.assert_array_equal(
            sorted(kept.all_points().tolist()), sorted([expected.tolist(), points[3].tolist()])
        )


def test_the_published_rule_draws_a_wall_towards_the_middle_of_its_voxels() -> None:
    """Why poses creep: noise of 2 cm, seen often, and the wall at 0.05 m stands at 0.1 m."""
    dice = np.random.default_rng(0)
    creeping, steady = VoxelMap(0.5, True), VoxelMap(0.5, False)
    for _ in range(300):
        wall = np.column_stack([0.05 + 0.02 * dice.normal(size=400), dice.uniform(0, 5, (400, 2))])
        creeping.insert(wall)
        steady.insert(wall)
    inside = [kept.all_points()[:, 0] for kept in (creeping, steady)]
    assert np.median(inside[0][inside[0] > 0]) > 0.08
    assert abs(np.median(inside[1][inside[1] > 0]) - 0.05) < 0.01


def test_the_map_grows_and_keeps_what_it_has() -> None:
    dice = np.random.default_rng(5)
    points = dice.uniform(-50, 50, (20_000, 3))
    at_once, bit_by_bit = VoxelMap(0.5, True), VoxelMap(0.5, True)
    at_once.insert(points)
    for part in np.array_split(points, 37):
        bit_by_bit.insert(part)
    assert len(at_once) == len(bit_by_bit) == len(np.unique(np.floor(points / 0.5), axis=0))
    np.testing.assert_array_equal(np.unique(at_once.all_points(), axis=0), np.unique(bit_by_bit.all_points(), axis=0))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e30])
def test_points_that_are_nowhere_are_passed_over(value) -> None:
    kept = VoxelMap(0.5, True)
    kept.insert(np.array([[1.0, 1.0, 1.0], [value, 0.0, 0.0], [0.0, value, value]]))
    assert len(kept) == 1
    assert len(neighbours(kept, (value, 0.0, 0.0), 5, 1.0)[0]) == 0
