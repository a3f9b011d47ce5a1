from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from taskslam.datasets.stamp_order import Pairing, in_stamp_order
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, ImuSamples, WheelOdometry
from taskslam.skipped import Skipped


def odometry(stamp: int) -> WheelOdometry:
    return WheelOdometry(stamp, SE2(), 0.0, 0.0)


@given(st.lists(st.integers(0, 5 * NANOSECONDS), max_size=60))
def test_what_comes_out_is_in_order_and_nothing_is_lost_in_silence(stamps):
    skipped = Skipped()
    out = [m.stamp for m in in_stamp_order(map(odometry, stamps), skipped)]
    assert out == sorted(out)
    assert len(out) + skipped.counts.total() == len(stamps)


@given(st.lists(st.integers(0, NANOSECONDS), max_size=60))
def test_within_a_second_nothing_is_late(stamps):
    skipped = Skipped()
    assert [m.stamp for m in in_stamp_order(map(odometry, stamps), skipped)] == sorted(stamps)


def test_odometry_comes_before_what_else_has_its_stamp():
    imu = ImuSamples(5, np.array([5]), np.zeros((1, 3)), np.zeros((1, 3)))
    assert list(in_stamp_order(iter([imu, odometry(5)]), Skipped())) == [odometry(5), imu]


def test_images_find_each_other_in_any_order_and_the_lonely_are_counted():
    skipped = Skipped()
    pairing, image = Pairing(skipped), np.zeros((2, 2), np.uint8)
    assert pairing.add(1, 100, image) is None
    assert pairing.add(0, 100, image)[0] == 100
    assert pairing.add(0, 200, image) is None
    assert pairing.add(1, 200 + NANOSECONDS, image) is None
    assert pairing.add(1, 250, image)[0] == 200  # within a millisecond; the left one's stamp
    pairing.end()
    assert skipped.counts == {"images without a partner": 1}
    for stamp in range(10 * NANOSECONDS, 110 * NANOSECONDS, NANOSECONDS):
        pairing.add(0, stamp, image)
    assert skipped.counts.total() == 1 + 68  # thirty-two wait
