import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.geometry import SE2, wrap_angle
from taskslam.measurements import NANOSECONDS
from taskslam.navigation.localization import Correction, Localization

START = SE2(2.0, -1.0, 0.5)
S = NANOSECONDS


def driven(seconds: int = 3) -> Localization:
    """1 m/s along a straight line, odometry at 10 Hz."""
    localization = Localization(START)
    for k in range(10 * seconds + 1):
        localization.odometry(k * S // 10, SE2(k / 10, 0.0, 0.0))
    return localization


def assert_same(a: SE2, b: SE2) -> None:
    assert (a.x, a.y) == pytest.approx((b.x, b.y), abs=1e-9)
    assert abs(wrap_angle(a.theta - b.theta)) < 1e-9


def test_before_any_estimate_the_start_pose_carries_odometry():
    assert_same(Localization(START).T_map_base(), START)
    assert_same(driven().T_map_base(), START @ SE2(3.0, 0.0, 0.0))


def test_an_estimate_corrects_the_pose_at_its_own_stamp_and_odometry_rides_on_top():
    localization = driven()
    estimate = SE2(0.9, 0.1, 0.2)  # of t = 1 s, arriving at t = 3 s
    assert localization.correct(1 * S, estimate) is Correction.APPLIED
    counted = localization.T_odom_base_at(1 * S)
    assert counted is not None
    assert_same(localization.T_map_odom @ counted, START @ estimate)
    assert_same(localization.T_map_base(), START @ estimate @ SE2(2.0, 0.0, 0.0))


def test_odometry_is_interpolated_between_its_stamps():
    localization = driven()
    localization.correct(15 * S // 100, SE2(0.15, 0.0, 0.0))
    assert_same(localization.T_map_odom, START)


def test_interpolation_takes_the_short_way_round():
    localization = Localization(SE2())
    localization.odometry(0, SE2(0, 0, math.pi - 0.1))
    localization.odometry(S, SE2(0, 0, -math.pi + 0.1))
    middle = localization.T_odom_base_at(S // 2)
    assert middle is not None
    assert abs(wrap_angle(middle.theta - math.pi)) < 1e-9


def test_estimates_outside_the_history_are_refused_by_name():
    localization = driven(seconds=15)
    before = localization.T_map_odom
    assert localization.correct(2 * S, SE2(9, 9, 1)) is Correction.TOO_OLD
    assert localization.correct(16 * S, SE2(9, 9, 1)) is Correction.AHEAD_OF_ODOMETRY
    assert localization.correct(14 * S, SE2(math.nan, 0, 0)) is Correction.NOT_FINITE
    assert localization.T_map_odom == before
    assert localization.correct(10 * S, SE2(10, 0, 0)) is Correction.APPLIED


def test_an_estimate_just_ahead_of_odometry_is_extrapolated():
    localization = driven()
    assert localization.correct(305 * S // 100, SE2(3.05, 0.0, 0.0)) is Correction.APPLIED
    assert_same(localization.T_map_odom, START)


poses = st.builds(SE2, st.floats(-50, 50), st.floats(-50, 50), st.floats(-3.1, 3.1))


@given(poses, st.integers(0, 30), poses)
def test_at_the_stamp_of_an_estimate_the_pose_is_the_estimate(start, tenth, estimate):
    localization = Localization(start)
    for k in range(31):
        localization.odometry(k * S // 10, SE2(0.1 * k, math.sin(k), 0.3 * k))
    localization.correct(tenth * S // 10, estimate)
    counted = localization.T_odom_base_at(tenth * S // 10)
    assert counted is not None
    at = localization.T_map_odom @ counted
    wanted = start @ estimate
    assert (at.x, at.y) == pytest.approx((wanted.x, wanted.y), abs=1e-6)
