"""Photometric adjustment on rendered views: its slope by numerical differences, and what it makes of wrong poses."""

import numpy as np
import pytest
from synthetic import EVERYTHING, PINHOLE, host

from taskslam.slam.bundle.photometric import adjust, linearise, moved
from taskslam.slam.vision.patches import Weighting
from taskslam.slam.vision.se3 import adjoint, exp_se3

LEVELS = 3
TRUE = [
    np.eye(4),
    exp_se3(np.array([0.05, 0.01, 0.05, 0, 0.02, 0])),
    exp_se3(np.array([0.1, -0.02, 0.1, 0.01, -0.01, 0])),
]
GAINS = np.array([1.0, 0.8, 1.1])
PAPER = Weighting(c2=2.0, nu=4.0, outlier=1.5, most_outliers=1)


@pytest.fixture(scope="module")
def window():
    """Images by level, hosts, rays, inverse depths and patches of three views, the middle one 20 % darker."""
    views = [host(T, LEVELS, gain) for T, gain in zip(TRUE, GAINS, strict=True)]
    lefts, rights = (tuple(np.stack([v[eye][level] for v in views]) for level in range(LEVELS)) for eye in (0, 1))
    hosts = np.repeat(np.arange(3), [len(v[2]) for v in views])
    rays, depths = np.concatenate([v[2] for v in views]), np.concatenate([v[3] for v in views])
    patches = tuple(np.concatenate([v[4][level] for v in views]) for level in range(LEVELS))
    return lefts, rights, hosts, rays, depths, patches


def linear(window, T, depths, weighting, level=0):
    lefts, rights, hosts, rays, _, patches = window
    here = PINHOLE.at_level(level)
    return linearise(lefts[level], rights[level], here, T, GAINS, hosts, rays, depths, patches[level], weighting)


def test_the_slope_is_that_of_the_cost(window):
    """With weights held (c2 and nu without bound, all weights are one), b and g are half the gradient of the cost.

    Patches are compared along the gradient of their host, which is not quite that of the image they are compared with,
    and between pixels an image is not smooth: one part in six.
    """
    plain = Weighting(c2=1e12, nu=1e12, outlier=1e9, most_outliers=4)
    T = moved(np.stack(TRUE), 2e-3 * np.random.default_rng(0).normal(size=18))
    depths = window[4] * 1.02

    def total(T, depths):
        _, _, fitting, mean = linear(window, T, depths, plain)
        return mean * fitting.sum()

    equations, _, _, _ = linear(window, T, depths, plain)
    for index in range(6, 18):
        step = np.zeros(18)
        step[index] = 1e-3
        numerical = (total(moved(T, step), depths) - total(moved(T, -step), depths)) / 4e-3
        assert equations.b[index] == pytest.approx(numerical, rel=1 / 6, abs=2e-2 * np.abs(equations.b).max())
    change = 1e-3 * depths
    numerical = (total(T, depths + change) - total(T, depths - change)) / 4
    assert equations.g @ change == pytest.approx(numerical, rel=1 / 6)


def test_the_blocks_between_poses_and_depths_are_those_of_one_jacobian(window):
    """[[H, W'], [W, h]] = J' J of any residuals is positive semidefinite, and blind to a motion of the whole window."""
    T = np.stack(TRUE)
    H, _, W, h, _ = linear(window, T, window[4], EVERYTHING)[0]
    whole = np.block([[H, W.T], [W, np.diag(h)]])
    values = np.linalg.eigvalsh(whole)
    assert values[0] > -1e-9 * values[-1]
    inverse = [np.linalg.inv(each) for each in T]
    for axis in range(6):
        world = np.zeros(6)
        world[axis] = 1.0
        together = np.concatenate([_twist(each, world) for each in inverse])
        assert np.abs(H @ together).max() < 1e-9 * np.abs(H).max()
        assert np.abs(W @ together).max() < 1e-9 * np.abs(W).max()


def _twist(T_camera_world, world):
    return adjoint(T_camera_world) @ world


def test_wrong_poses_and_depths_come_right(window):
    lefts, rights, hosts, rays, depths, patches = window
    random = np.random.default_rng(5)
    wrong = moved(np.stack(TRUE), np.concatenate([np.zeros(6), 8e-3 * random.normal(size=12)]))
    noisy = depths * (1.0 + 0.05 * random.normal(size=len(depths)))
    found = adjust(
        lefts, rights, PINHOLE, wrong, GAINS, hosts, rays, noisy, patches, PAPER, LEVELS - 1, 8, (0.02, 10.0)
    )

    def off(T):
        return [np.linalg.norm(each[:3, 3] - true[:3, 3]) for each, true in zip(T, TRUE, strict=True)]

    np.testing.assert_array_equal(found.T_world_keyframes[0], TRUE[0])
    assert max(off(found.T_world_keyframes)) < 0.15 * max(off(wrong))
    before, after = (np.median(np.abs(each / depths - 1.0)) for each in (noisy, found.inverse_depths))
    assert after < 0.3 * before
    assert (2 * found.fitting > found.seen).mean() > 0.9


def test_depths_stay_within_their_bounds(window):
    lefts, rights, hosts, rays, depths, patches = window
    found = adjust(
        lefts, rights, PINHOLE, np.stack(TRUE), GAINS, hosts, rays, depths, patches, PAPER, 2, 5, (0.45, 0.5)
    )
    assert found.inverse_depths.min() >= 0.45
    assert found.inverse_depths.max() <= 0.5
