"""The events of a run: what happened, when, and where the robot stood. One event is one line of the journal.

A field name means the same in every event: `t` is integer nanoseconds of simulated time within the run, `round` counts
from 0 over all rounds of the run (a priming round included), `goal` is the index into the sequence, from 0. All poses
are in the frame `map`; a pose that is not known (the truth, on a real robot) is None. No event holds a wall-clock
value: two runs with the same inputs must write the same bytes (design D2).
"""

from __future__ import annotations

import json
import operator
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, ClassVar, TypeAlias

from pydantic_core import from_json

from taskslam.errors import RecordError, did_you_mean
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.reading import LARGEST_NUMBER
from taskslam.task import MOST_GOALS, MOST_ROUNDS

_MOST = 2**63 - 1


@dataclass(frozen=True, slots=True)
class RoundStarted:
    """A round begins. priming: this round only builds the map and never counts (protocol D0.3)."""

    kind: ClassVar[str] = "round_started"
    t: int
    round: int
    priming: bool


@dataclass(frozen=True, slots=True)
class GoalStarted:
    """A goal was handed to navigation."""

    kind: ClassVar[str] = "goal_started"
    t: int
    round: int
    goal: int
    target: SE2


@dataclass(frozen=True, slots=True)
class Arrival:
    """The robot stands at a reached goal, at the end of the pause (protocol D0.5).

    truth: where it is; estimate: where SLAM says it is; odometry: where wheel odometry alone would put it.
    """

    kind: ClassVar[str] = "arrival"
    t: int
    round: int
    goal: int
    target: SE2
    truth: SE2 | None
    estimate: SE2 | None
    odometry: SE2 | None


@dataclass(frozen=True, slots=True)
class GoalFailed:
    """A goal was not reached. outcome names the reason, detail says it in a sentence; poses as in `Arrival`."""

    kind: ClassVar[str] = "goal_failed"
    t: int
    round: int
    goal: int
    target: SE2
    outcome: Outcome
    detail: str
    truth: SE2 | None
    estimate: SE2 | None
    odometry: SE2 | None

    def words(self, primed: bool) -> str:
        """A sentence for people, who count rounds and waypoints from 1. primed: whether the first round is priming."""
        return f"{round_in_words(self.round, primed)}, waypoint {self.goal + 1}: {self.outcome}: {self.detail}"


@dataclass(frozen=True, slots=True)
class GoalSkipped:
    """The round went on past a goal that had failed, as the scenario's `on_failure: skip` has it."""

    kind: ClassVar[str] = "goal_skipped"
    t: int
    round: int
    goal: int


@dataclass(frozen=True, slots=True)
class RoundEnded:
    """A round is over: `reached` if it ran to its last goal. frames: sensor frames offered to the method."""

    kind: ClassVar[str] = "round_ended"
    t: int
    round: int
    outcome: Outcome
    frames: int
    dropped_frames: int


@dataclass(frozen=True, slots=True)
class MethodNotice:
    """Something that the method's host wants remembered, such as a restart."""

    kind: ClassVar[str] = "method_notice"
    t: int
    round: int
    text: str


@dataclass(frozen=True, slots=True)
class RunEnded:
    """The last event. complete: every goal of every round was reached."""

    kind: ClassVar[str] = "run_ended"
    t: int
    complete: bool


Event: TypeAlias = (
    RoundStarted | GoalStarted | Arrival | GoalFailed | GoalSkipped | RoundEnded | MethodNotice | RunEnded
)

EVENT_TYPES: dict[str, type[Event]] = {
    cls.kind: cls
    for cls in (RoundStarted, GoalStarted, Arrival, GoalFailed, GoalSkipped, RoundEnded, MethodNotice, RunEnded)
}


def round_in_words(number: int, primed: bool) -> str:
    """A round of the journal as people count: `priming round`, or from 1. primed: whether the first one is priming."""
    counted = number if primed else number + 1
    return f"round {counted}" if counted else "priming round"


def encode_event(event: Event) -> str:
    """One line of JSON without the line end: sorted keys, floats by repr, so that they come back bit for bit.

    Raises RecordError if a field has the wrong type or holds NaN or infinity.
    """
    record: dict[str, Any] = {"event": event.kind}
    for field in fields(event):
        try:
            record[field.name] = _ENCODERS[field.name](getattr(event, field.name))
        except (TypeError, ValueError, AttributeError) as error:
            raise RecordError(f"event {event.kind}: field '{field.name}': {error}") from None
    return json.dumps(record, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False)


def decode_event(line: str | bytes) -> Event:
    """The event that `encode_event` wrote. Raises RecordError saying what was expected."""
    try:
        # Three times as fast as the json module, and the time of an evaluation is spent here.
        record = from_json(line, allow_inf_nan=False)
    except ValueError as error:
        raise RecordError(f"expected one JSON object, but {error}") from None
    if not isinstance(record, dict):
        raise RecordError(f"expected one JSON object, found {type(record).__name__}")
    kind = record.pop("event", None)
    if not isinstance(kind, str) or kind not in EVENT_TYPES:
        hint = did_you_mean(str(kind), EVENT_TYPES)
        raise RecordError(f"unknown event {kind!r}; expected one of {', '.join(EVENT_TYPES)}.{hint}")
    cls, decoders = _PLANS[kind]
    if record.keys() != decoders.keys():
        raise RecordError(f"event {kind}: expected the fields {sorted(decoders)}, found {sorted(record)}")
    for name, value in record.items():
        try:
            record[name] = decoders[name](value)
        except (TypeError, ValueError, OverflowError) as error:
            raise RecordError(f"event {kind}: field '{name}': {error}") from None
    return cls(**record)


def _flag(value: object) -> bool:
    if type(value).__name__ not in ("bool", "bool_"):
        raise TypeError(f"expected true or false, found {value!r}")
    return bool(value)


def _count(value: object) -> int:
    if type(value) is int and 0 <= value <= _MOST:
        return value
    if isinstance(value, bool):
        raise TypeError(f"expected an integer, found {value!r}")
    number = operator.index(value)  # type: ignore[arg-type]  # raises TypeError for floats and strings
    if not 0 <= number <= _MOST:
        raise ValueError(f"expected an integer from 0 to {_MOST}, found {number if abs(number) < _MOST**2 else 'more'}")
    return number


def _round(value: object) -> int:
    if (number := _count(value)) > MOST_ROUNDS:
        raise ValueError(f"expected a round from 0 to {MOST_ROUNDS}, found {number}")
    return number


def _goal(value: object) -> int:
    if (number := _count(value)) >= MOST_GOALS:
        raise ValueError(f"expected a goal below {MOST_GOALS}, found {number}")
    return number


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError(f"expected a string, found {value!r}")
    # A lone surrogate (undecodable bytes of a guest's output) cannot be written as UTF-8.
    return value.encode("utf-8", "backslashreplace").decode("utf-8")


def _outcome(value: object) -> str:
    return Outcome(str(value)).value


def _pose(pose: SE2) -> list[float]:
    if not pose.is_finite():
        raise ValueError(f"expected a finite pose, found {pose}")
    return [float(pose.x), float(pose.y), float(pose.theta)]


def _optional_pose(pose: SE2 | None) -> list[float] | None:
    return None if pose is None else _pose(pose)


def _read_pose(value: object) -> SE2:
    if type(value) is list and len(value) == 3:
        x, y, theta = value
        # Nearly every pose of a journal is three small floats, whose sum is small too: the rest is looked at.
        if type(x) is type(y) is type(theta) is float and abs(x) + abs(y) + abs(theta) <= LARGEST_NUMBER:
            return SE2(x, y, theta)
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError(f"expected [x, y, theta], found {value!r}")
    for number in value:
        if isinstance(number, bool) or not isinstance(number, int | float) or not abs(number) <= LARGEST_NUMBER:
            raise ValueError(f"expected three finite numbers, found {value!r}")
    return SE2(*(float(number) for number in value))


def _read_optional_pose(value: object) -> SE2 | None:
    return None if value is None else _read_pose(value)


_POSES = ("truth", "estimate", "odometry")
_COUNTS = ("t", "frames", "dropped_frames")
_ENCODERS: dict[str, Callable[[Any], Any]] = {
    **dict.fromkeys(_COUNTS, _count),
    "round": _round,
    "goal": _goal,
    **dict.fromkeys(("priming", "complete"), _flag),
    **dict.fromkeys(("detail", "text"), _text),
    **dict.fromkeys(_POSES, _optional_pose),
    "target": _pose,
    "outcome": _outcome,
}
_DECODERS: dict[str, Callable[[Any], Any]] = {
    **_ENCODERS,
    **dict.fromkeys(_POSES, _read_optional_pose),
    "target": _read_pose,
    "outcome": Outcome,
}
_PLANS = {
    kind: (cls, {field.name: _DECODERS[field.name] for field in fields(cls)}) for kind, cls in EVENT_TYPES.items()
}
