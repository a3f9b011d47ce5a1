import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from taskslam.navigation.inflation import inflate, inflation_costs
from taskslam.navigation.settings import CostmapSettings

SETTINGS = CostmapSettings()


def reference(layers, resolution):
    distance = ndimage.distance_transform_edt(layers != 254) * resolution
    cost = np.floor(252 * np.exp(-5.0 * (distance - 0.20)))
    cost[distance > 0.5 + 1e-9] = 0
    cost[distance <= 0.20 + 1e-9] = 253
    cost[layers == 254] = 254
    return cost.astype(np.uint8)


def inflated(layers, resolution):
    reach, costs = inflation_costs(SETTINGS, resolution)
    master = np.zeros_like(layers)
    inflate(layers, master, 0, layers.shape[0], 0, layers.shape[1], reach, costs)
    return master


def test_costs_at_the_published_distances():
    layers = np.zeros((21, 41), np.uint8)
    layers[10, 20] = 254
    cost = inflated(layers, 0.05)
    assert cost[10, 20] == 254
    assert cost[10, 24] == 253  # 0.20 m: the inscribed radius
    assert cost[10, 26] == math.floor(252 * math.exp(-5 * 0.10))  # 0.30 m
    assert cost[10, 30] == math.floor(252 * math.exp(-5 * 0.30))  # 0.50 m
    assert cost[10, 31] == 0


@given(st.integers(0, 10_000), st.sampled_from([0.05, 0.1]), st.floats(0.001, 0.3))
def test_any_grid_agrees_with_the_exact_distance_transform(seed, resolution, density):
    random = np.random.default_rng(seed)
    layers = np.where(random.random((30, 43)) < density, 254, 0).astype(np.uint8)
    if not layers.any():
        layers[7, 9] = 254
    np.testing.assert_array_equal(inflated(layers, resolution), reference(layers, resolution))


def test_a_window_is_renewed_from_obstacles_beyond_its_edge():
    layers = np.zeros((60, 60), np.uint8)
    layers[30, 18] = 254
    reach, costs = inflation_costs(SETTINGS, 0.05)
    master = np.zeros_like(layers)
    inflate(layers, master, 20, 40, 20, 40, reach, costs)
    whole = reference(layers, 0.05)
    np.testing.assert_array_equal(master[20:40, 20:40], whole[20:40, 20:40])
    assert not master[:20].any()
