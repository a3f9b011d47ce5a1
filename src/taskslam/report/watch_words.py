"""How far a folder of runs is, in words: for the page that is watched, and for the terminal."""

from __future__ import annotations

import math
from dataclasses import dataclass

from taskslam.benchmark.campaign.state import State
from taskslam.benchmark.campaign.watching import Closer, Look, Seen
from taskslam.record.events import Arrival, Event, GoalFailed, MethodNotice, RoundEnded, RoundStarted
from taskslam.report import words

SIGNS = {
    "✓": "every goal reached",
    "✗": "a goal missed",
    "▸": "under way",
    "…": "interrupted",
    "!": "could not be driven",
    "·": "waiting",
}
_BY_STATE = {State.UNDER_WAY: "▸", State.INTERRUPTED: "…", State.NOT_DRIVEN: "!", State.WAITING: "·"}


@dataclass(frozen=True)
class Told:
    """An event in words. when: simulated time; kind: round, arrival, failure or notice."""

    when: str
    kind: str
    what: str


def sign_of(run: Seen) -> str:
    """One of SIGNS."""
    return _BY_STATE.get(run.state) or ("✓" if run.complete else "✗")


def counts_in_words(look: Look) -> str:
    """`240 runs: 12 finished, 1 under way, 227 waiting`."""
    counts = look.counts
    parts = [f"{counts[state]} {state}" for state in State if counts[state]]
    return f"{words.count(len(look.runs), 'run')}: {', '.join(parts)}"


def outlook_in_words(look: Look) -> str:
    """What is left, when it will be done, and on what that rests."""
    outlook = look.outlook
    if outlook is None:
        return "Nothing is left to drive." if look.counts[State.FINISHED] == len(look.runs) else ""
    left = f"{words.hours(outlook.core_s)} of one core are left"
    basis = "by what is finished here" if outlook.measured else "by a table of prices, until runs here tell it better"
    if outlook.seconds is None:
        return f"{left}, {basis}; nothing is being driven now."
    at_once = words.count(len(look.under_way), "run")
    return f"About {words.hours(outlook.seconds)} to the end, with {at_once} at a time ({left}, {basis})."


def where_in_words(closer: Closer) -> str:
    """`round 2 of 5 · goal 7 of 12 · 3 min 20 s simulated`, or how it ended."""
    seen = closer.seen
    if seen.state is State.FINISHED:
        return "every goal of every round was reached" if seen.complete else seen.detail or "not every goal was reached"
    if seen.state in {State.WAITING, State.NOT_DRIVEN}:
        return seen.detail or str(seen.state)
    parts = [] if seen.state is State.UNDER_WAY else [str(seen.state)]
    if closer.round is not None:
        parts.append(closer.round_in_words(closer.round))
    if closer.heading is not None:
        parts.append(f"goal {closer.heading + 1} of {len(closer.goals)}")
    if closer.now is not None:
        parts.append(f"{words.minutes(closer.now / 1e9)} simulated")
    return " · ".join(parts) or "starting"


def happened(closer: Closer) -> list[Told]:
    """What is worth a line, the newest first."""
    told = [Told(words.minutes(event.t / 1e9), *_in_words(event, closer)) for event in closer.events]
    return [one for one in told if one.what][::-1]


def _in_words(event: Event, closer: Closer) -> tuple[str, str]:
    if isinstance(event, RoundStarted):
        return "round", f"{closer.round_in_words(event.round)} begins"
    if isinstance(event, Arrival):
        return "arrival", f"goal {event.goal + 1} reached{_off(event)}"
    if isinstance(event, GoalFailed):
        return "failure", f"goal {event.goal + 1}: {words.outcome(event.outcome)}. {event.detail}"
    if isinstance(event, MethodNotice):
        return "notice", event.text
    if isinstance(event, RoundEnded) and event.dropped_frames:
        return "round", f"{event.dropped_frames} of {event.frames} frames came while the method was busy"
    return "", ""


def _off(event: Arrival) -> str:
    """How far from the goal the robot truly stands."""
    if event.truth is None:
        return ""
    metres = math.hypot(event.truth.x - event.target.x, event.truth.y - event.target.y)
    return f", {words.centimetres(metres)} cm off"
