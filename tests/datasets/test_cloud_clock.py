import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskslam.datasets.cloud_clock import CloudClock, cloud_clock

SCALES = {"nanoseconds": 1.0, "microseconds": 1e3, "milliseconds": 1e6, "seconds": 1e9}
KINDS = {
    "nanoseconds": ["u4", "f8"],
    "microseconds": ["u4", "f8", "f4"],
    "milliseconds": ["f8", "f4"],
    "seconds": ["f8", "f4"],
}


def clouds(name, unit, kind, turn_ns, since_1970, began, period_ns):
    """Five clouds whose points are spread over a turn, by a clock; their stamps are those of the first points."""
    told = []
    for number in range(5):
        stamp = began + number * period_ns
        offsets = np.sort(np.random.default_rng(number).uniform(0, turn_ns, 50))
        offsets[[0, -1]] = 0, turn_ns
        times = ((stamp if since_1970 else 0) + offsets) / SCALES[unit]
        told.append(({"x": np.zeros(50), name: times.astype(kind)}, stamp, offsets))
    return told


@given(
    unit=st.sampled_from(sorted(SCALES)), name=st.sampled_from(["time", "t", "timestamp", "offset_time", "stamps"]),
    choice=st.integers(0, 2), since_1970=st.booleans(), rate=st.sampled_from([5.0, 10.0, 20.0]),
    began=st.sampled_from([1_000_000_000, 1_716_393_934_250_000_000]),
)  # fmt: skip
@settings(max_examples=200, deadline=None, derandomize=True)
def test_any_unit_is_told_from_the_turn(unit, name, choice, since_1970, rate, began):
    kinds = ["f8"] if since_1970 else KINDS[unit]
    period = round(1e9 / rate)
    told = clouds(name, unit, kinds[choice % len(kinds)], 0.97 * period, since_1970, began, period)
    clock = cloud_clock([(cells, stamp) for cells, stamp, _ in told], period)
    assert (clock.field, clock.scale, clock.since_1970) == (name, SCALES[unit], since_1970)
    for cells, stamp, offsets in told:
        assert clock.offsets(cells, stamp) == pytest.approx(offsets, abs=2000)
    usual = unit == "seconds" if kinds[choice % len(kinds)] != "u4" else unit == "nanoseconds"
    plain = usual and since_1970 == (name == "timestamp") and name != "stamps"
    assert (clock.note == "") == plain


def test_a_share_of_the_turn_becomes_time():
    told = clouds("time", "nanoseconds", "f8", 1.0, False, 10**9, 10**8)
    clock = cloud_clock([(cells, stamp) for cells, stamp, _ in told], 1e8)
    assert clock.note.endswith("runs from 0 to 1 and is taken for the share of a turn")
    assert clock.offsets(told[0][0], 10**9).max() == 10**8


def test_what_fits_no_unit_is_not_believed():
    told = clouds("time", "nanoseconds", "f8", 7e5, False, 10**9, 10**8)
    clock = cloud_clock([(cells, stamp) for cells, stamp, _ in told], 1e8)
    assert clock.note.endswith("fits no unit of time, given a turn of 0.1 s, and is not believed")
    assert not clock.offsets(told[0][0], 10**9).any()


def test_clouds_without_times_or_points_have_none():
    assert cloud_clock([({"x": np.zeros(9), "intensity": np.zeros(9)}, 0)], 1e8) == CloudClock()
    assert cloud_clock([({"x": np.zeros(0), "time": np.zeros(0)}, 0)], 1e8) == CloudClock()
    assert cloud_clock([], None) == CloudClock()
