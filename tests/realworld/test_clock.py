import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskslam.realworld.clock import estimate_offset, zone_slip

PAUSE = 5.0


def laps(rounds: int, seed: int, even: bool = False) -> list[float]:
    """Stamps of two waypoints per lap, laps of about two minutes."""
    rng = np.random.default_rng(seed)
    stamps, now = [], 100.0
    for _ in range(rounds):
        for leg in (40.0, 80.0):
            now += leg + PAUSE + (0 if even else rng.uniform(0, 6))
            stamps.append(now)
    return stamps


def seen(stamps: list[float], offset: float) -> list[tuple[float, float]]:
    """The robot is at rest for the pause and a moment more."""
    return [(stamp - PAUSE + offset, stamp + 0.3 + offset) for stamp in stamps]


def pauses(stamps: list[float]) -> list[tuple[float, float]]:
    return [(stamp - PAUSE, stamp) for stamp in stamps]


@settings(deadline=None, max_examples=40)
@given(offset=st.floats(-50_000, 50_000), seed=st.integers(0, 1000))
def test_the_offset_is_found_to_the_rest_of_the_pause(offset, seed):
    stamps = laps(5, seed)
    found = estimate_offset([(pauses(stamps), seen(stamps, offset))])
    assert abs(found.offset - offset) < 0.5
    assert found.certain
    assert found.matched == 10


@pytest.mark.parametrize(("offset", "hours"), [(3600.0, 1.0), (-3599.2, -1.0), (19800.4, 5.5), (7200, 2.0)])
def test_an_hour_is_named(offset, hours):
    stamps = laps(5, 3)
    found = estimate_offset([(pauses(stamps), seen(stamps, offset))])
    assert zone_slip(found.offset) == hours


@pytest.mark.parametrize("offset", [0.3, -40.0, 100.0, 1500.0])
def test_a_slow_clock_is_no_time_zone(offset):
    assert zone_slip(offset) is None


def test_arrivals_without_a_camera_and_rests_without_an_arrival_do_not_disturb():
    stamps = laps(5, 1)
    rests = [*seen(stamps[::2], 12.0), (5000.0, 5004.0), (6000.0, 6030.0)]
    found = estimate_offset([([*pauses(stamps[::2]), (7000.0, 7005.0)], rests)])
    assert abs(found.offset - 12.0) < 0.5
    assert found.matched == 5


def test_a_robot_parked_for_an_hour_does_not_swallow_the_tour():
    stamps = laps(5, 2)
    found = estimate_offset([(pauses(stamps), [*seen(stamps, 3.0), (-8000.0, 0.0)])])
    assert abs(found.offset - 3.0) < 0.5


def test_one_arrival_fits_anywhere_and_is_not_believed():
    found = estimate_offset([(pauses([100.0]), [(200.0, 206.0), (900.0, 906.0)])])
    assert not found.certain


def test_laps_as_even_as_clockwork_leave_a_rival_one_lap_away():
    stamps = laps(30, 0, even=True)
    found = estimate_offset([(pauses(stamps), seen(stamps, 0.0))])
    assert found.rival > 0.9


@pytest.mark.parametrize("groups", [[], [([], [])], [([(0.0, 5.0)], [])], [([], [(0.0, 5.0)])]])
def test_nothing_to_match_is_no_offset(groups):
    found = estimate_offset(groups, given=2.0)
    assert found.offset == 2.0
    assert not found.certain
