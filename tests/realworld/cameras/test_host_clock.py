from __future__ import annotations

import pytest

from taskslam.realworld.cameras.host_clock import ClockState, clock_state, parse_chrony, parse_timesync

CHRONY = """Reference ID    : C0A80101 (gateway)
Stratum         : 3
System time     : 0.612000012 seconds slow of NTP time
Last offset     : +0.000004321 seconds
Leap status     : Normal
"""
TIMESYNC = """       Server: 192.168.1.1 (gateway)
         Leap: normal
       Offset: {offset}
        Delay: 2.1ms
"""


def test_a_clock_that_chrony_calls_slow_lies_behind_utc() -> None:
    state = parse_chrony(CHRONY)
    assert state.offset == pytest.approx(-0.612000012)
    assert "0.61 s slow" in (state.warning or "")
    assert parse_chrony(CHRONY.replace("slow", "fast")).offset == pytest.approx(0.612000012)


def test_a_chrony_without_a_server_knows_nothing() -> None:
    for text in (CHRONY.replace("Normal", "Not synchronised"), "", "506 Cannot talk to daemon"):
        assert parse_chrony(text).offset is None


@pytest.mark.parametrize(
    ("told", "offset"),
    [("+12.500ms", -0.0125), ("-850us", 0.00085), ("-1.2s", 1.2), ("+1min 2.5s", -62.5), ("1h", -3600.0)],
)
def test_the_time_services_offset_is_the_servers_minus_ours(told: str, offset: float) -> None:
    state = parse_timesync(TIMESYNC.format(offset=told))
    assert state is not None
    assert state.offset == pytest.approx(offset)
    assert (state.warning is None) == (abs(offset) <= 0.5)


def test_an_offset_that_cannot_be_read_is_none() -> None:
    assert parse_timesync("Server: n/a") is None
    assert parse_timesync(TIMESYNC.format(offset="n/a")) is None


def test_an_unknown_offset_is_said_to_be_unknown() -> None:
    assert "unknown (nobody asked)" in (ClockState(None, "nobody asked").warning or "")


def test_this_computer_answers_one_way_or_another() -> None:
    assert clock_state().told_by
