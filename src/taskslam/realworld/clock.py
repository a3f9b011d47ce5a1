"""Two clocks, one robot: how far a camera's clock is ahead of the robot's, found from the data.

The robot stands still when it has arrived. So the right offset is the one that lays the pauses of the log over the
rests that the images show: the overlap, summed over all arrivals, is a piecewise linear function of the offset, whose
highest plateau is found exactly. Laps that resemble one another give it lower rivals; how much lower is reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from taskslam.geometry import FloatArray

Interval: TypeAlias = tuple[float, float]
"""Begin and end, s."""

FARTHEST = 14 * 3600.0
"""s: the widest offset between time zones."""

RIVAL = 0.95
"""Above this ratio of overlaps a second offset fits nearly as well, and the first is not to be trusted."""

_SHORTEST_REST = 0.4  # of a pause
_REST_SLACK = 1.0  # s

_ZONE_STEP = 900.0
_ZONE_SLACK = 60.0
_MOST_PAIRS = 2_000_000


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """offset: s, image stamp minus arrival stamp. width: s, of the plateau on which all offsets fit as well.

    overlap: s of pause over which the robot rests. given: the same for the offset that was assumed. rival: the best
    overlap of an offset elsewhere, over this one's. matched: arrivals that overlap a rest, of `arrivals`.
    """

    offset: float
    width: float
    overlap: float
    given: float
    rival: float
    matched: int
    arrivals: int

    @property
    def certain(self) -> bool:
        """Whether at least two arrivals match, more than half of them, and no other offset fits nearly as well."""
        return self.matched >= 2 and 2 * self.matched > self.arrivals and self.rival < RIVAL


def zone_slip(offset: float) -> float | None:
    """Hours, if an offset (s) is that of another time zone or of summer time, to a minute; None if it is not."""
    steps = round(offset / _ZONE_STEP)
    return steps / 4 if steps and abs(offset - steps * _ZONE_STEP) <= _ZONE_SLACK else None


def estimate_offset(groups: Sequence[tuple[Sequence[Interval], Sequence[Interval]]], given: float = 0.0) -> ClockOffset:
    """The offset (s) to add to the pauses so that they meet the rests.

    groups: pauses by the robot's clock, and rests by the camera's, of what can only be one another: those of one
    waypoint, or of one camera. given: the offset that was assumed.
    """
    pauses = [(np.array(p, float).reshape(-1, 2), np.array(r, float).reshape(-1, 2)) for p, r in groups]
    count = sum(len(p) for p, _ in pauses)
    longest = max((float(np.diff(p, axis=1).max(initial=0.0)) for p, _ in pauses), default=0.0)
    pauses = [(p, _ends_of_rests(r, longest)) for p, r in pauses]
    places, slopes = _corners_of_overlap(pauses)
    if not len(places):
        return ClockOffset(given, 0.0, 0.0, 0.0, 0.0, 0, count)
    order = np.argsort(places, kind="stable")
    places, slope = places[order], np.cumsum(slopes[order])
    overlap = np.concatenate([[0.0], np.cumsum(slope[:-1] * np.diff(places))])
    best = float(overlap.max())
    top = np.flatnonzero(overlap >= best - max(1e-6, 1e-3 * best))
    # The plateau around the first of the highest corners; another as high elsewhere is a rival.
    low = high = places[top[0]]
    for place in places[top]:
        if place - high < 1.0:
            high = place
    elsewhere = np.abs(places - (low + high) / 2) > (high - low) / 2 + 2 * longest
    offset = float((low + high) / 2)
    return ClockOffset(
        offset=offset,
        width=float(high - low),
        overlap=best,
        given=float(np.interp(given, places, overlap, left=0.0, right=0.0)),
        rival=float(overlap[elsewhere].max(initial=0.0)) / best,
        matched=sum(_matched(p + offset, r) for p, r in pauses),
        arrivals=count,
    )


def _ends_of_rests(rests: FloatArray, pause: float) -> FloatArray:
    """The parts of rests in which a pause may lie: at their begin or at their end.

    A robot rests from the begin of its pause, or until the end of it; one that is parked for an hour in between must
    not match whatever is laid over it.
    """
    rests = rests[np.diff(rests, axis=1)[:, 0] >= _SHORTEST_REST * pause]
    part = pause + _REST_SLACK
    long = np.diff(rests, axis=1)[:, 0] > 2 * part
    begins, ends = rests[long].copy(), rests[long].copy()
    begins[:, 1], ends[:, 0] = begins[:, 0] + part, ends[:, 1] - part
    return np.concatenate([rests[~long], begins, ends])


def _corners_of_overlap(
    groups: Sequence[tuple[FloatArray, FloatArray]],
) -> tuple[FloatArray, FloatArray]:
    """Where the summed overlap bends, and by how much its slope changes there.

    One pause [a, b] and one rest [c, d] overlap, when the pause moves by t, by a trapezoid: up from c - b, down to
    d - a, level between c - a and d - b.
    """
    places, slopes = [], []
    for pauses, rests in groups:
        step = max(1, _MOST_PAIRS // max(1, len(rests)))
        for part in (pauses[i : i + step] for i in range(0, len(pauses), step)):
            a, b = part[:, 0, None], part[:, 1, None]
            c, d = rests[None, :, 0], rests[None, :, 1]
            near = (np.abs(c - a) <= FARTHEST) & (np.abs(d - b) <= FARTHEST)
            first, second = np.minimum(c - a, d - b)[near], np.maximum(c - a, d - b)[near]
            up, down = (c - b)[near], (d - a)[near]
            places += [up, first, second, down]
            slopes += [np.ones(up.size), -np.ones(up.size), -np.ones(up.size), np.ones(up.size)]
    if not places:
        return np.empty(0), np.empty(0)
    return np.concatenate(places), np.concatenate(slopes)


def _matched(pauses: FloatArray, rests: FloatArray) -> int:
    """How many pauses are covered by a rest for at least half of their time."""
    if not len(pauses) or not len(rests):
        return 0
    overlap = np.minimum(pauses[:, 1, None], rests[None, :, 1]) - np.maximum(pauses[:, 0, None], rests[None, :, 0])
    return int((overlap.max(axis=1) >= 0.5 * np.diff(pauses, axis=1)[:, 0]).sum())
