"""The filter's moments against those of the posterior, integrated numerically."""

import numpy as np
import pytest
from scipy import stats

from taskslam.slam.svo.depth_filter import observe, start_depths, update_depth
from taskslam.slam.vision.pinhole import Pinhole

SPAN = 5.0


@pytest.mark.parametrize("x", [0.5, 0.53, 0.7, 1.5])
@pytest.mark.parametrize(("a", "b"), [(10.0, 10.0), (30.0, 4.0)])
def test_the_moments_are_those_of_the_posterior(x, a, b):
    mean, variance, tau2 = 0.5, 0.02**2, 0.03**2
    d, pi = np.linspace(0.2, 0.8, 6001)[:, None], np.linspace(1e-4, 1 - 1e-4, 999)[None]
    likelihood = pi * stats.norm.pdf(x, d, tau2**0.5) + (1 - pi) / SPAN
    joint = likelihood * stats.norm.pdf(d, mean, variance**0.5) * stats.beta.pdf(pi, a, b)
    joint /= joint.sum()
    expected_mean = (joint * d).sum()
    expected_variance = (joint * d**2).sum() - expected_mean**2
    expected_pi = (joint * pi).sum()
    state = np.array([mean, variance, a, b])
    update_depth(state, x, tau2, SPAN)
    assert state[0] == pytest.approx(expected_mean, abs=1e-5)
    assert state[1] == pytest.approx(expected_variance, rel=1e-2)
    assert state[2] / (state[2] + state[3]) == pytest.approx(expected_pi, rel=1e-3)


def test_a_point_seen_from_aside_learns_its_depth():
    pinhole = Pinhole(360.0, 376.0, 240.0, 0.11)
    random = np.random.default_rng(0)
    rays = np.column_stack([random.uniform(-0.5, 0.5, (40, 2)), np.ones(40)])
    truth = random.uniform(0.2, 1.0, 40)
    states = start_depths(truth * 1.05, 0.05)
    hosts = np.zeros(40, np.int64)
    for step in range(1, 12):
        T = np.eye(4)
        T[0, 3] = -0.02 * step
        q = rays + truth[:, None] * T[:3, 3]
        seen = 360.0 * q[:, :2] / q[:, 2:] + (376.0, 240.0) + random.normal(0, 0.3, (40, 2))
        observe(states, T[None], hosts, rays, seen, np.zeros((40, 2)), pinhole, 0.5)
    assert np.median(np.abs(states[:, 0] / truth - 1)) < 0.01
    assert (states[:, 1] < 0.01**2).all()


def test_a_camera_that_stands_teaches_nothing():
    states = start_depths(np.array([0.5]), 0.05)
    before = states.copy()
    seen = np.array([[380.0, 244.0]])
    ray = np.array([[4.0 / 360, 4.0 / 360, 1.0]])
    pinhole = Pinhole(360.0, 376.0, 240.0, 0.11)
    observe(states, np.eye(4)[None], np.zeros(1, np.int64), ray, seen + 1.0, np.zeros((1, 2)), pinhole, 1.0)
    np.testing.assert_array_equal(states, before)
