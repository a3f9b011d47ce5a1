"""Points from two keyframes: by rays, by a disparity, and not from what does not fit."""

import numpy as np
import pytest

from taskslam.slam.gf_gg.triangulation import match_between, triangulate
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.se3 import exp_se3

PINHOLE = Pinhole(360.0, 376.0, 240.0, 0.11)
COUNT = 40


@pytest.fixture
def views():
    """Two poses half a metre apart, points six metres before them, and how each sees them; the second is shuffled."""
    random = np.random.default_rng(1)
    poses = np.eye(4), exp_se3(np.array([-0.5, 0.05, 0.1, 0.02, 0.05, 0.01]))
    places = np.column_stack([random.uniform(-2, 2, COUNT), random.uniform(-1, 1, COUNT), random.uniform(4, 8, COUNT)])
    seen = []
    for T in poses:
        p = places @ T[:3, :3].T + T[:3, 3]
        u, v = PINHOLE.f * p[:, 0] / p[:, 2] + PINHOLE.cx, PINHOLE.f * p[:, 1] / p[:, 2] + PINHOLE.cy
        seen.append(np.column_stack((u, v, u - PINHOLE.f * PINHOLE.baseline / p[:, 2])))
    return poses, places, seen


@pytest.mark.parametrize("disparities", [True, False])
def test_points_are_where_they_are(views, disparities):
    poses, places, seen = views
    if not disparities:
        seen[0][:, 2], seen[1][:, 2] = np.nan, np.nan
    octaves = np.zeros(COUNT, np.int64)
    found = triangulate(*poses, tuple(seen), (octaves, octaves), PINHOLE, 1.2)
    np.testing.assert_allclose(found, places, atol=1e-6)


def test_what_does_not_fit_both_views_is_no_point(views):
    poses, _, seen = views
    octaves, coarse = np.zeros(COUNT, np.int64), np.full(COUNT, 5)
    seen[1][::2, 1] += 12.0
    found = triangulate(*poses, tuple(seen), (octaves, octaves), PINHOLE, 1.2)
    np.testing.assert_array_equal(np.isnan(found[:, 0]), np.arange(COUNT) % 2 == 0)
    assert np.isnan(triangulate(*poses, tuple(seen), (octaves, coarse), PINHOLE, 1.2)).all()  # as large, but no nearer


def test_features_are_matched_along_the_line(views):
    poses, _, seen = views
    random = np.random.default_rng(2)
    descriptors = random.integers(0, 2**63, (COUNT, 4)).astype(np.uint64)
    shuffled = random.permutation(COUNT)
    octaves, groups, unused = np.zeros(COUNT, np.int64), np.arange(COUNT) % 3, np.ones(COUNT, bool)
    second = seen[1][shuffled].copy()
    second[5, 1] += 9.0  # off its line
    matches = match_between(
        poses[1],
        (seen[0], second),
        (octaves, octaves),
        (descriptors, descriptors[shuffled]),
        (groups, groups[shuffled]),
        (unused, unused),
        PINHOLE,
        1.2,
        50,
    )
    expected = np.argsort(shuffled)
    expected[shuffled[5]] = -1
    np.testing.assert_array_equal(matches, expected)
