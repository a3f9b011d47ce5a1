"""Each logged arrival meets the images of its pause, and ends as measured, not seen, or ambiguous, with the reason.

Not seen: the camera looked, in both halves of the pause, and the robot was not (wholly) where a robot that has arrived
would be. That is the robot's affair and counts. Ambiguous: the images do not decide (none was taken, the robot moved,
there were two of it). That is the measurement's affair and never counts against a method.

Why both halves: an image from the very begin or end of a pause lies outside it once the clocks differ by a second.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np

from taskslam.geometry import SE2, FloatArray, mean_heading, wrap
from taskslam.measurements import NANOSECONDS
from taskslam.realworld.arrivals import LoggedArrival
from taskslam.realworld.looks import Look
from taskslam.realworld.sighting import Fault, NoSighting, Sighting, Station
from taskslam.realworld.stillness import StillRun, motion_px, still_runs

MOST_FRAMES = 20
"""Images at rest that are used for one arrival."""

_LEAST_REST = 0.4  # of the pause, for the rest to be an arrival


class Verdict(StrEnum):
    """How an arrival ended."""

    MEASURED = "measured"
    NOT_SEEN = "not seen"
    AMBIGUOUS = "ambiguous"


@dataclass(frozen=True, eq=False)
class MeasuredArrival:
    """An arrival and what the images say. pose and below: None unless measured.

    reason: why not, in a sentence; empty for a measured one. image: that the reason, or the pose, rests on. look: its
    place in the station's looks. pose: of the base in the station's frame, the median over `frames` images; covariance:
    (3, 3) of one image; spread_m: root mean squared distance of the images' poses from it.
    """

    arrival: LoggedArrival
    station: Station
    verdict: Verdict
    reason: str = ""
    look: int | None = None
    pose: SE2 | None = None
    covariance: FloatArray | None = None
    residual_px: float | None = None
    margin_px: float | None = None
    frames: int = 0
    spread_m: float | None = None
    other_heading: float | None = None

    @property
    def image(self) -> str | None:
        """File name of the image."""
        return None if self.look is None else self.station.looks[self.look].frame.path.name


def judge(
    arrival: LoggedArrival, station: Station, stamps: Sequence[int], offset: float, pause: float, frames: int
) -> MeasuredArrival:
    """What a station's images say about an arrival.

    stamps: ns, of the station's looks. offset: s, image stamp minus arrival stamp. pause: s of rest before the
    arrival's stamp. frames: images that must show the robot at rest.
    """
    end = arrival.stamp + round(offset * NANOSECONDS)
    first, last = bisect_left(stamps, end - round(pause * NANOSECONDS)), bisect_right(stamps, end)
    if first == last:
        return _no_image(arrival, station, stamps, end)
    found = {row: station.measure(row) for row in range(first, last)}
    good = {row: sighting for row, sighting in found.items() if isinstance(sighting, Sighting)}
    if not good:
        blank = {row: n for row, n in found.items() if isinstance(n, NoSighting)}
        return _no_pose(arrival, station, blank, end - round(pause * NANOSECONDS / 2), frames)
    twice = [row for row, n in found.items() if isinstance(n, NoSighting) and n.fault is Fault.TWICE]
    if twice:
        return _ambiguous(arrival, station, twice[0], found[twice[0]])
    rows = sorted(good)
    rests = _rests([station.looks[row] for row in rows], pause, frames)
    if len(rests) != 1:
        return _not_at_rest(arrival, station, rows, rests, frames)
    used = rows[rests[0].first : rests[0].last + 1]
    used = used[:: -(-len(used) // MOST_FRAMES)]
    return _measured(arrival, station, used, [good[row] for row in used])


def _rests(looks: Sequence[Look], pause: float, frames: int) -> list[StillRun]:
    """Still runs long enough, in time and in images, to be the pause."""
    least = 0 if frames == 1 else round(_LEAST_REST * pause * NANOSECONDS)
    return [run for run in still_runs(looks) if run.last - run.first + 1 >= frames and run.end - run.begin >= least]


def _measured(
    arrival: LoggedArrival, station: Station, rows: Sequence[int], sightings: Sequence[Sighting]
) -> MeasuredArrival:
    poses = np.array([sighting.pose.array() for sighting in sightings])
    heading = mean_heading(poses[:, 2])
    heading += float(np.median(wrap(poses[:, 2] - heading)))
    x, y = np.median(poses[:, :2], axis=0).tolist()
    others = [sighting.other_heading for sighting in sightings if sighting.other_heading is not None]
    return MeasuredArrival(
        arrival,
        station,
        Verdict.MEASURED,
        look=rows[len(rows) // 2],
        pose=SE2(x, y, float(wrap(heading))),
        covariance=np.median([sighting.covariance for sighting in sightings], axis=0),
        residual_px=float(np.median([sighting.residual_px for sighting in sightings])),
        margin_px=min(sighting.margin_px for sighting in sightings),
        frames=len(rows),
        spread_m=float(np.sqrt(((poses[:, :2] - (x, y)) ** 2).sum(axis=1).mean())),
        other_heading=mean_heading(np.array(others)) if others else None,
    )


def _no_image(arrival: LoggedArrival, station: Station, stamps: Sequence[int], end: int) -> MeasuredArrival:
    if not stamps:
        return MeasuredArrival(arrival, station, Verdict.AMBIGUOUS, f"{station.name} took no image")
    nearest = min(range(len(stamps)), key=lambda row: abs(stamps[row] - end))
    away = abs(stamps[nearest] - end) / NANOSECONDS
    name = station.looks[nearest].frame.path.name
    reason = f"{station.name} took no image during the pause; the nearest, {name}, is {away:.1f} s away"
    return MeasuredArrival(arrival, station, Verdict.AMBIGUOUS, reason, nearest)


def _no_pose(
    arrival: LoggedArrival, station: Station, found: dict[int, NoSighting], middle: int, frames: int
) -> MeasuredArrival:
    """The kind of fault that most images share decides; absence, if they cover the pause about its middle (ns).

    Where one image is enough to measure an arrival (frames: 1), one is enough to miss it.
    """
    kinds = Counter(no.fault for no in found.values())
    fault = min(kinds, key=lambda kind: (-kinds[kind], kind))
    rows = [row for row, no in found.items() if no.fault is fault]
    row = rows[len(rows) // 2]
    if fault in (Fault.NO_TAG, Fault.CUT):
        reason = f"{found[row].reason} in {station.looks[row].frame.path.name}, one of {len(found)} images"
        absent = [row for row, no in found.items() if no.fault in (Fault.NO_TAG, Fault.CUT)]
        early, late = (station.looks[absent[place]].frame.stamp for place in (0, -1))
        if frames == 1 or early < middle <= late:
            return MeasuredArrival(arrival, station, Verdict.NOT_SEEN, reason, row)
        half = "first" if late < middle else "second"
        reason = f"{reason}; all are from the {half} half of the pause, which does not prove that the robot was absent"
        return MeasuredArrival(arrival, station, Verdict.AMBIGUOUS, reason, row)
    return _ambiguous(arrival, station, row, found[row])


def _ambiguous(arrival: LoggedArrival, station: Station, row: int, found: Sighting | NoSighting) -> MeasuredArrival:
    assert isinstance(found, NoSighting)
    reason = f"{found.reason} in {station.looks[row].frame.path.name}"
    return MeasuredArrival(arrival, station, Verdict.AMBIGUOUS, reason, row)


def _not_at_rest(
    arrival: LoggedArrival, station: Station, rows: Sequence[int], rests: Sequence[StillRun], frames: int
) -> MeasuredArrival:
    looks = station.looks
    first, last = looks[rows[0]], looks[rows[-1]]
    names = f"{first.frame.path.name} and {last.frame.path.name}"
    if rests:
        at = [looks[rows[run.first]].frame.path.name for run in rests[:2]]
        reason = f"the robot stood at two places during the pause, in {at[0]} and in {at[1]}"
    elif len(rows) < frames:
        reason = (
            f"only {len(rows)} of the {frames} images that are needed show the tag, the last {last.frame.path.name}"
        )
    elif len(still_runs([looks[row] for row in rows])) == 1:
        length = (last.frame.stamp - first.frame.stamp) / NANOSECONDS
        reason = f"the images show the tag for {length:.1f} s only, between {names}: too short to tell rest from motion"
    else:
        most = max(motion_px(looks[a], looks[b]) for a, b in pairwise(rows))
        reason = f"the robot was not at rest: up to {most:.1f} px from image to image between {names}"
    return MeasuredArrival(arrival, station, Verdict.AMBIGUOUS, reason, rows[len(rows) // 2])
