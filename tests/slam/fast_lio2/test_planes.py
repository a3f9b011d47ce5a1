"""Planes through neighbours, and the measurement's derivative against numerical differences."""

import numpy as np

from taskslam.slam.fast_lio2.planes import find_planes, plane_through, residuals
from taskslam.slam.fast_lio2.state import DIMENSIONS, plus
from taskslam.slam.fast_lio2.voxel_map import VoxelMap

COLUMNS = [0, 1, 2, 3, 4, 5, 15, 16, 17, 18, 19, 20]


def test_a_plane_through_five_noisy_points_is_that_of_the_singular_values() -> None:
    dice = np.random.default_rng(2)
    plane = np.zeros(4)
    for _ in range(200):
        normal = dice.normal(size=3)
        normal /= np.linalg.norm(normal)
        across = np.linalg.svd(normal[None])[2][1:]
        points = dice.normal(size=3) + dice.uniform(-0.7, 0.7, (5, 2)) @ across
        points += 0.003 * dice.normal(size=(5, 1)) * normal
        values = np.linalg.svd(points - points.mean(axis=0))[1]
        farthest, width = plane_through(points, np.arange(5), plane)
        if values[1] < 0.1:  # nearly in a line
            continue
        exact = np.linalg.svd(points - points.mean(axis=0))[2][2]
        assert abs(exact @ plane[:3]) > np.cos(0.01)
        np.testing.assert_allclose(np.abs(points @ plane[:3] + plane[3]).max(), farthest, atol=1e-12)
        assert 0.3 < width / (values[0] * values[1] / (values @ values)) ** 2 < 1.05


def test_points_in_a_line_make_no_plane() -> None:
    line = np.outer(np.arange(5.0), [1.0, 2.0, 0.5]) + 1.0
    assert plane_through(line, np.arange(5), np.zeros(4)) == (np.inf, 0.0)
    assert plane_through(np.ones((5, 3)), np.arange(5), np.zeros(4)) == (np.inf, 0.0)


def test_a_step_is_no_plane(state) -> None:
    """Neighbours on two surfaces 60 cm apart lie off any plane by more than the tolerance."""
    x, y = np.meshgrid(np.arange(-2, 2, 0.5) + 0.25, np.arange(-2, 2, 0.5) + 0.25)
    floor = np.column_stack([x.ravel(), y.ravel(), np.where(x.ravel() > 0, 0.6, 0.0) + 0.1])
    kept = VoxelMap(0.5, True)
    kept.insert(floor)
    identity = state._replace(R=np.eye(3), p=np.zeros(3), R_il=np.eye(3), p_il=np.zeros(3))
    query = np.array([[0.25, 0.25, 0.5], [-1.5, 0.2, 0.1]])
    planes = find_planes(kept.keys, kept.points, kept.size, query, identity, 5, 2.0, 0.1)
    assert not planes[0].any()
    np.testing.assert_allclose(np.abs(planes[1]), [0, 0, 1, 0.1, 1], atol=1e-9)


def test_the_derivative_equals_numerical_differences(state) -> None:
    dice = np.random.default_rng(4)
    points = dice.uniform(-6, 6, (40, 3))
    normals = dice.normal(size=(40, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    world = (points @ state.R_il.T + state.p_il) @ state.R.T + state.p
    planes = np.column_stack([normals, 0.02 * dice.normal(size=40) - np.sum(world * normals, axis=1)])
    r, H = residuals(points, planes, state, 0.0, True)
    assert len(r) == 40
    step = 1e-6
    for column, direction in enumerate(COLUMNS):
        d = np.zeros(DIMENSIONS)
        d[direction] = step
        numerical = (
            residuals(points, planes, plus(state, d), 0.0, True)[0]
            - residuals(points, planes, plus(state, -d), 0.0, True)[0]
        ) / (2 * step)
        np.testing.assert_allclose(H[:, column], numerical, atol=1e-7)
    without = residuals(points, planes, state, 0.0, False)[1]
    np.testing.assert_array_equal(without, np.where(np.arange(12) < 6, H, 0.0))


def test_only_points_that_fit_their_plane_count(state) -> None:
    """The score is 1 - 0.9 |r| / sqrt(range): at 4 m, 0.9 allows 22 cm."""
    points = np.array([[4.0, 0, 0], [4.0, 0, 0], [4.0, 0, 0], [4.0, 0, 0]])
    world = (points @ state.R_il.T + state.p_il) @ state.R.T + state.p
    planes = np.zeros((4, 4))
    for n, off in enumerate((0.21, 0.23, -0.21)):
        planes[n] = [1, 0, 0, off - world[n, 0]]
    np.testing.assert_allclose(residuals(points, planes, state, 0.9, False)[0], [0.21, -0.21])
