"""A jump and an impossible speed are told once; noise and slow drift are not told at all."""

import numpy as np

from taskslam.benchmark.plausibility import Plausibility
from taskslam.geometry import SE2

PERIOD = 100_000_000
AWAY = SE2(20.0, -10.0, 1.0)  # far from odometry's origin, where a turn of map->odom has a long lever


def doubts(offsets):
    """What is said about poses that lie `offsets` (SE2 in the robot's frame) beside odometry, 10 a second."""
    watch = Plausibility()
    said = []
    for k, offset in enumerate(offsets):
        T_odom_base = AWAY @ SE2(0.03 * k, 0.0, 0.0)
        T_map_odom = T_odom_base @ offset @ T_odom_base.inverse()
        said.append(watch.doubt(k * PERIOD, T_map_odom, T_odom_base))
    return said


def test_a_jump_is_told_once_where_it_happens():
    said = doubts([SE2()] * 20 + [SE2(0.0, 0.8, 0.0)] * 20)
    assert said[20] == "jumped by 0.80 m, 0.00 rad"
    assert [s for s in said if s] == [said[20]]


def test_a_leap_in_small_steps_is_a_speed():
    said = [s for s in doubts([SE2(0.06 * k, 0.0, 0.0) for k in range(11)]) if s]
    assert said
    assert said[0] == "moves at 0.60 m/s, 0.00 rad/s against odometry"


def test_noise_of_centimetres_and_the_drift_of_odometry_are_believed():
    random = np.random.default_rng(0)
    noisy = [SE2(*(0.03 * random.standard_normal(2)), 0.01 * random.standard_normal()) for _ in range(300)]
    drifting = [SE2(0.004 * k, 0.0, 0.002 * k) for k in range(300)]
    assert not any(doubts(noisy) + doubts(drifting))


def test_a_small_turn_far_from_the_origin_of_odometry_is_no_jump():
    assert not any(doubts([SE2()] * 10 + [SE2(0.0, 0.0, 0.1)] * 10))
