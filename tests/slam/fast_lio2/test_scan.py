"""A scan thinned and moved to the end of its turn."""

import numpy as np
import pytest

from taskslam.slam.fast_lio2.scan import centroids, chosen, deskewed
from taskslam.slam.fast_lio2.state import DIMENSIONS, State, carried
from taskslam.slam.inertial.rotations import exp_so3


def test_every_fourth_point_beyond_the_blind_range_that_is_a_point() -> None:
    points = np.zeros((24, 3), np.float32)
    points[:, 0] = np.arange(24)
    points[8] = np.nan
    points[12, 0] = np.inf
    points[20, 0] = 200.0
    kept, offsets = chosen(points, -np.arange(24, dtype=np.int32) * 1000, 4, 2.0, 130.0)
    np.testing.assert_array_equal(kept[:, 0], [4, 16])
    np.testing.assert_allclose(offsets, [-4e-6, -16e-6])


@pytest.mark.parametrize("rate", [np.array([0.0, 0.0, 0.8]), np.array([0.5, -0.3, 1.2])])
def test_points_of_a_turn_are_seen_from_its_end(rate) -> None:
    """Landmarks seen from a LiDAR that turns and speeds up, each at its own instant."""
    dice = np.random.default_rng(0)
    g, force = np.array([0.0, 0.0, -9.8]), np.array([0.5, 0.2, 9.8])
    R_il, p_il = exp_so3(np.array([0.1, 0.2, 0.3])), np.array([0.1, -0.05, 0.4])
    start = State(
        exp_so3(np.array([0.0, 0.1, 0.5])), np.ones(3), np.array([0.3, 0.1, 0]), np.zeros(3), np.zeros(3), R_il, p_il, g
    )

    def after(seconds):
        pieces = np.full(round(seconds / 1e-4), 1e-4)
        readings = np.tile(rate, (len(pieces), 1)), np.tile(force, (len(pieces), 1))
        return carried(start, np.eye(DIMENSIONS), pieces, *readings, np.zeros((len(pieces), 4)))[0]

    times = np.array([0.0, 0.013, 0.05, 0.0512, 0.0999, 0.1])
    landmarks = dice.uniform(-5, 5, (len(times), 3))

    def seen(x, landmark):
        return x.R_il.T @ (x.R.T @ (landmark - x.p) - x.p_il)

    points = np.array([seen(after(t) if t else start, landmark) for t, landmark in zip(times, landmarks, strict=True)])
    end, _, track = carried(
        start, np.eye(DIMENSIONS), np.full(10, 0.01), np.tile(rate, (10, 1)), np.tile(force, (10, 1)), np.zeros((10, 4))
    )
    expected = np.array([seen(end, landmark) for landmark in landmarks])
    np.testing.assert_allclose(deskewed(points, times - 0.1, track, end), expected, atol=1e-5)
    assert np.abs(points - expected).max() > 0.1


def test_the_points_of_a_voxel_become_their_mean() -> None:
    dice = np.random.default_rng(1)
    points = dice.normal(0, 2, (3000, 3))
    cells, index = np.unique(np.floor(points / 0.5), axis=0, return_inverse=True)
    expected = np.zeros((len(cells), 3))
    np.add.at(expected, index.ravel(), points)
    expected /= np.bincount(index.ravel())[:, None]
    found = centroids(points, 0.5)
    np.testing.assert_allclose(np.sort(found, axis=0), np.sort(expected, axis=0), atol=1e-12)
    assert centroids(np.zeros((0, 3)), 0.5).shape == (0, 3)
