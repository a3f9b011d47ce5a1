"""Features that one translation explains, and those that it does not."""

import numpy as np

from taskslam.slam.msckf.two_point_ransac import one_translation

DRAWS = np.random.default_rng(0).integers(0, 60, (20, 2))


def test_those_that_go_their_own_way_are_told_from_the_rest() -> None:
    """Landmarks at several depths, the camera going ahead and aside; every fourth drifts off its epipolar line."""
    dice = np.random.default_rng(1)
    depth = dice.uniform(1, 6, (60, 1))
    at = np.column_stack([dice.uniform(-0.8, 0.8, (60, 2)) * depth, depth])
    before, at = at[:, :2] / depth, at - [0.1, 0.02, 0.05]
    now = at[:, :2] / at[:, 2:]
    now[::4] += dice.choice([-0.06, 0.06], (15, 2))
    agree = one_translation(before, now, DRAWS, 0.005)
    assert np.delete(agree, np.arange(0, 60, 4)).all()
    assert np.count_nonzero(agree[::4]) <= 3  # along the line any shift agrees


def test_features_that_stand_give_no_direction_and_nothing_agrees() -> None:
    still = np.random.default_rng(2).uniform(-0.5, 0.5, (60, 2))
    assert not one_translation(still, still, DRAWS, 0.005).any()
