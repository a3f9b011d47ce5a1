"""Which offset a camera's clock has: as given, if the data do not contradict it, or estimated."""

from __future__ import annotations

from collections.abc import Sequence

from taskslam.errors import InputError
from taskslam.measurements import NANOSECONDS
from taskslam.realworld.arrivals import ArrivalLog
from taskslam.realworld.clock import ClockOffset, Interval, estimate_offset, zone_slip
from taskslam.realworld.setup_file import CameraSource
from taskslam.realworld.sighting import Station
from taskslam.realworld.stillness import StillRun


def clock_offset(
    source: CameraSource, stations: Sequence[tuple[Station, Sequence[StillRun]]], log: ArrivalLog, pause: float
) -> tuple[float, list[str]]:
    """The offset (s) of one camera's clock for one run, and what is worth saying about it.

    stations: those that this camera serves, with the rests that it saw there.

    Raises:
        InputError: the offset is to be estimated and cannot be, or the data say that the given one is wrong: the
            difference is named, as a time zone where it is one.
    """
    given = 0.0 if source.clock_offset == "estimate" else float(source.clock_offset)
    origin = log.arrivals[0].stamp  # seconds since then keep their digits
    found = estimate_offset([_group(station, rests, log, pause, origin) for station, rests in stations], given)
    if source.clock_offset == "estimate":
        if not found.certain:
            raise InputError(f"camera {source.name}: its clock offset cannot be estimated: {_why_uncertain(found)}")
        return found.offset, [f"camera {source.name}: {_named(found.offset)}"]
    if found.certain and found.given < 0.5 * found.overlap:
        raise InputError(
            f"camera {source.name}: with clock_offset {given:g} s, {found.given:.0f} s of pause meet a robot at rest;"
            f" with {found.offset:.1f} s {found.overlap:.0f} s do: {_named(found.offset - given)}."
            f" Set clock_offset to {found.offset:.1f}, or to `estimate`."
        )
    return given, []


def _group(
    station: Station, rests: Sequence[StillRun], log: ArrivalLog, pause: float, origin: int
) -> tuple[list[Interval], list[Interval]]:
    stamps = [(arrival.stamp - origin) / NANOSECONDS for arrival in log.arrivals if arrival.goal in station.goals]
    seen = [((rest.begin - origin) / NANOSECONDS, (rest.end - origin) / NANOSECONDS) for rest in rests]
    return [(stamp - pause, stamp) for stamp in stamps], seen


def _named(difference: float) -> str:
    slip = zone_slip(difference)
    sign = "ahead" if difference > 0 else "behind"
    if slip is None:
        return f"its clock is {abs(difference):.1f} s {sign}"
    hours = f"{abs(slip):g} h"
    rest = abs(difference) - abs(slip) * 3600
    return f"its clock is {hours} {sign} (a time zone or summer time), and {rest:+.1f} s"


def _why_uncertain(found: ClockOffset) -> str:
    if not found.matched:
        return f"none of {found.arrivals} arrivals meets a robot at rest"
    if 2 * found.matched <= found.arrivals or found.matched < 2:
        return f"at best {found.matched} of {found.arrivals} arrivals meet a robot at rest; give it in seconds"
    return (
        f"{found.offset:.1f} s fits best, but another fits {found.rival:.0%} as well (laps resemble one another);"
        " give it in seconds"
    )
