"""What led to a failed goal: a short timeline from the journal and the trajectories, ending with the failure itself."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray, wrap_angle
from taskslam.measurements import NANOSECONDS
from taskslam.record import Event, GoalFailed, GoalStarted, MethodNotice, RoundStarted, Trajectory
from taskslam.report import words
from taskslam.report.tracks import Tracks

WINDOW_S = 30.0  # how far back path, speed and error are shown
_STEP_S = 0.25  # between two samples of speed and error
_STILL = 0.02  # m/s: slower than this the robot stands
_MOST_STEPS = 12
_LONGEST_TEXT = 200
_NUMBERS = re.compile(r"-?\d+(?:\.\d+)?")


@dataclass(frozen=True)
class Step:
    """One line of the timeline. before_s: seconds before the failure; kind: goal, notice, measured or failure."""

    before_s: float
    text: str
    kind: str


@dataclass(frozen=True)
class Story:
    """A failure and what came before it.

    times: (N,) seconds before the failure, negative; speed: (N,) m/s and error: (N,) metres from truth to estimate at
    those times, NaN where unknown; path, believed: (K, 3) true and estimated poses in `map` of those seconds.
    """

    steps: tuple[Step, ...]
    times: FloatArray
    speed: FloatArray
    error: FloatArray
    path: FloatArray
    believed: FloatArray


def failure_story(failure: GoalFailed, events: Sequence[Event], tracks: Tracks, tolerance_m: float) -> Story:
    """The story of one failed goal. tolerance_m: of navigation; an estimate further off than this cannot arrive."""
    began = _leg_began(failure, events)
    truth, estimate = tracks.get(failure.round, "truth"), tracks.get(failure.round, "estimate")
    times = np.arange(-min(WINDOW_S, (failure.t - began) / NANOSECONDS), _STEP_S / 2, _STEP_S)
    speed, error = _speed(truth, failure.t, times), _error(truth, estimate, failure.t, times)
    steps = [*_from_journal(failure, events, began), *_from_tracks(failure.t, began, truth, estimate, tolerance_m)]
    steps.sort(key=lambda step: -step.before_s)
    steps += _belief(failure)
    end = Step(0.0, _cut(failure.detail) or words.outcome(failure.outcome.value), "failure")
    return Story(
        steps=(*_shortened(steps), end),
        times=times,
        speed=speed,
        error=error,
        path=_last_seconds(truth, failure.t, times),
        believed=_last_seconds(estimate, failure.t, times),
    )


def _leg_began(failure: GoalFailed, events: Sequence[Event]) -> int:
    """When the goal that failed was set, ns."""
    starts = [e.t for e in events if isinstance(e, GoalStarted) and (e.round, e.goal) == (failure.round, failure.goal)]
    return min(max(starts, default=0), failure.t)


def _from_journal(failure: GoalFailed, events: Sequence[Event], began: int) -> Iterator[Step]:
    """The round's beginning, the goal, and what the method's host noticed on the way to it."""
    for event in events:
        if isinstance(event, RoundStarted) and event.round == failure.round:
            yield Step(_before(event.t, failure.t), "the round begins", "goal")
        if isinstance(event, GoalStarted) and event.round == failure.round and event.t == began:
            origin = f" from waypoint {event.goal}" if event.goal else ""
            yield Step(_before(event.t, failure.t), f"sets out{origin} for waypoint {event.goal + 1}", "goal")
    notices = [e for e in events if isinstance(e, MethodNotice) and e.round == failure.round and e.t <= failure.t]
    # What the method's state was when the goal was set, if it was not tracking, is part of the story too.
    earlier = [notice for notice in notices if notice.t < began and " -> " in notice.text]
    if earlier and not earlier[-1].text.endswith("-> tracking"):
        yield Step(_before(earlier[-1].t, failure.t), _cut(earlier[-1].text), "notice")
    yield from _merged([notice for notice in notices if notice.t >= began], failure.t)


def _merged(notices: Sequence[MethodNotice], end: int) -> Iterator[Step]:
    """Notices that say the same with other numbers, one after another, become one line."""
    groups: list[list[MethodNotice]] = []
    for notice in notices:
        if groups and _shape(groups[-1][-1]) == _shape(notice):
            groups[-1].append(notice)
        else:
            groups.append([notice])
    for group in groups:
        text = _cut(group[0].text.replace("->", "→"))
        if len(group) > 1:
            text = f"{len(group)} times until {_before(group[-1].t, end):.1f} s before the end, first: {text}"
        yield Step(_before(group[0].t, end), text, "notice")


def _shape(notice: MethodNotice) -> str:
    return _NUMBERS.sub("#", notice.text)


def _from_tracks(end: int, began: int, truth: Trajectory, estimate: Trajectory, tolerance_m: float) -> Iterator[Step]:
    """Since when the estimate was off by more than the tolerance, SLAM was silent, and the robot stood."""
    known = estimate.stamps <= end
    if len(truth) and known.any():
        stamps, off = estimate.stamps[known], distance_to_truth(truth, estimate)[known]
        inside = np.flatnonzero(off <= tolerance_m)
        first = int(inside[-1]) + 1 if len(inside) else 0
        if first < len(off):
            what = f"the estimate is {words.length(off[first])} off the truth, and stays off by more than"
            if not len(inside):
                what = f"from the round's beginning the estimate is off, here by {words.length(off[first])}: more than"
            text = f"{what} navigation's tolerance of {words.length(tolerance_m)}"
            yield Step(_before(int(stamps[first]), end), text, "measured")
        silent = _before(int(stamps[-1]), end)
        if silent > 1.0:
            yield Step(silent, "the last estimate; SLAM is silent from here", "measured")
    before = np.arange(-_before(began, end), 0.0, _STEP_S)
    moving = np.flatnonzero(_speed(truth, end, before) > _STILL)
    if len(moving) and -before[moving[-1]] > 1.0:
        yield Step(float(-before[moving[-1]]), "the robot comes to a stand", "measured")


def _belief(failure: GoalFailed) -> Iterator[Step]:
    """How far off SLAM was when the goal failed: navigation knew nothing else."""
    if failure.truth is not None and failure.estimate is not None:
        off = words.length(failure.truth.distance_to(failure.estimate))
        turn = words.degrees(abs(wrap_angle(failure.truth.theta - failure.estimate.theta)))
        yield Step(0.0, f"SLAM puts the robot {off} and {turn}° from where it truly is", "measured")


def distance_to_truth(truth: Trajectory, estimate: Trajectory) -> FloatArray:
    """(N,) metres from each estimate to the truth at its own stamp, linearly between two true poses."""
    at = (estimate.stamps - truth.stamps[0]) / NANOSECONDS
    known = (truth.stamps - truth.stamps[0]) / NANOSECONDS
    x, y = (np.interp(at, known, truth.poses[:, axis]) for axis in (0, 1))
    return np.asarray(np.hypot(estimate.poses[:, 0] - x, estimate.poses[:, 1] - y))


def _speed(truth: Trajectory, end: int, times: FloatArray) -> FloatArray:
    """(N,) m/s over the step before each time."""
    if len(truth) < 2 or not len(times):
        return np.full(len(times), np.nan)
    known = (truth.stamps - end) / NANOSECONDS
    now, then = (
        np.column_stack([np.interp(at, known, truth.poses[:, axis]) for axis in (0, 1)])
        for at in (times, times - _STEP_S)
    )
    return np.asarray(np.hypot(*(now - then).T) / _STEP_S)


def _error(truth: Trajectory, estimate: Trajectory, end: int, times: FloatArray) -> FloatArray:
    """(N,) metres between estimate and truth; NaN before the first estimate and after the last one."""
    if not len(truth) or not len(estimate):
        return np.full(len(times), np.nan)
    known = (estimate.stamps - end) / NANOSECONDS
    return np.interp(times, known, distance_to_truth(truth, estimate), left=np.nan, right=np.nan)


def _last_seconds(track: Trajectory, end: int, times: FloatArray) -> FloatArray:
    since = end + int((times[0] if len(times) else 0.0) * NANOSECONDS)
    return track.poses[(track.stamps >= since) & (track.stamps <= end)]


def _shortened(steps: list[Step]) -> list[Step]:
    """At most so many lines: the first and the last ones, and a word on how many were left out between them."""
    if len(steps) <= _MOST_STEPS:
        return steps
    head, tail = steps[: _MOST_STEPS // 2], steps[-(_MOST_STEPS // 2 - 1) :]
    left_out = len(steps) - len(head) - len(tail)
    return [*head, Step(steps[len(head)].before_s, f"and {left_out} more notices", "notice"), *tail]


def _before(t: int, end: int) -> float:
    return (end - t) / NANOSECONDS


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST_TEXT else text[: _LONGEST_TEXT - 1] + "…"
