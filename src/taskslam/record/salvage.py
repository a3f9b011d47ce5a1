"""What a damaged journal still says: a bit has flipped, or a block of the disk was cut out.

Events before and after a line that cannot be read are as good as ever, so they are kept. A flipped digit leaves a line
that can be read and is wrong; it is found where it contradicts its neighbours or run.json, and left out as well.

What was in a lost line? Where a failed goal ends its round (`on_failure: abort`, in a run that we drove ourselves), a
goal that the round went past was reached: its arrival is there again, without poses, and counts as missing data. Any
other goal without a readable arrival counts as not reached, since nobody can tell. So damage may cost a method
completeness, and never gives it any.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from taskslam.errors import RecordError
from taskslam.geometry import wrap_angle
from taskslam.mode import Mode
from taskslam.outcomes import Outcome
from taskslam.record.events import Arrival, Event, GoalFailed, GoalSkipped, GoalStarted, RoundEnded, RoundStarted
from taskslam.record.journal import JournalLine
from taskslam.record.manifest import Manifest
from taskslam.task import OnFailure

Cell = tuple[int, int]
"""Round and goal."""

_MOST_DAMAGED = 0.1  # of the lines
_FORGIVEN = 3  # lines of a short journal, or half of one that is shorter still
_SAME_PLACE = 1e-6  # m and rad


@dataclass(frozen=True)
class Salvaged:
    """events: in order, lost arrivals and lost beginnings of rounds among them. damaged: a sentence for each line.

    lost: cells of arrivals that surely happened, of which no pose can be read.
    """

    events: tuple[Event, ...]
    damaged: tuple[str, ...]
    lost: frozenset[Cell]


def salvage(lines: Sequence[JournalLine], manifest: Manifest, path: Path) -> Salvaged:
    """What the lines of the journal at `path` say. An intact one comes back as it is.

    Raises:
        RecordError: more than a tenth of the lines (of a short journal: more than three) cannot be used: the file is
            another run's, or nobody's.
    """
    wrong = {index: line.event for index, line in enumerate(lines) if isinstance(line.event, str)}
    wrong |= _contradictions(lines, manifest)
    usable = {i: line.event for i, line in enumerate(lines) if i not in wrong and not isinstance(line.event, str)}
    reasons = wrong | _lost_beginnings(usable)
    if not reasons:
        return Salvaged(tuple(usable.values()), (), frozenset())
    damaged = tuple(f"{path}, line {lines[index].number}: {reasons[index]}" for index in sorted(reasons))
    if len(wrong) > max(_MOST_DAMAGED * len(lines), min(_FORGIVEN, len(lines) / 2)):
        raise RecordError(f"{len(wrong)} of {len(lines)} lines of the journal cannot be used; the first: {damaged[0]}")
    events = list(_with_beginnings(list(usable.values()), manifest))
    if not _aborts(manifest):
        return Salvaged(tuple(events), damaged, frozenset())
    whole, lost = _with_lost_arrivals(events, manifest)
    return Salvaged(tuple(whole), damaged, frozenset(lost))


def _aborts(manifest: Manifest) -> bool:
    """Whether a failed goal surely ended its round. Not so for robots that others drove."""
    return manifest.source == "simulation" and manifest.task.protocol.on_failure is OnFailure.ABORT


def _contradictions(lines: Sequence[JournalLine], manifest: Manifest) -> dict[int, str]:
    """Why a line that can be read cannot be right, by its place among the lines."""
    events = [(index, line.event) for index, line in enumerate(lines) if not isinstance(line.event, str)]
    missed = {(e.round, e.goal) for _, e in events if isinstance(e, GoalFailed | GoalSkipped)}
    wrong = dict(_strangers(events))
    begun, arrived = set[int](), set[Cell]()
    for index, event in events:
        if index in wrong:
            continue
        if isinstance(event, RoundStarted):
            if event.round in begun:
                wrong[index] = f"round {event.round} begins a second time"
            begun.add(event.round)
        elif isinstance(event, GoalStarted | Arrival | GoalFailed) and not _is_goal(event, manifest):
            wrong[index] = f"its target is not that of goal {event.goal} in run.json"
        elif isinstance(event, Arrival):
            cell = event.round, event.goal
            if cell in arrived or cell in missed:
                wrong[index] = f"goal {event.goal} in round {event.round} ends a second time"
            arrived.add(cell)
    return wrong


def _lost_beginnings(events: Mapping[int, Event]) -> dict[int, str]:
    """The first events of rounds whose beginnings are gone, by their place among the lines."""
    begun, found = set[int](), dict[int, str]()
    for index, event in events.items():
        number = getattr(event, "round", None)
        if number is not None and number not in begun:
            begun.add(number)
            if not isinstance(event, RoundStarted):
                found[index] = f"round {number} has no beginning that can be read before this line"
    return found


def _strangers(events: Sequence[tuple[int, Event]]) -> Iterator[tuple[int, str]]:
    """Events of another round than that of the event before and of the one after."""
    numbered = [(index, event, event.round) for index, event in events if hasattr(event, "round")]
    for place, (index, event, number) in enumerate(numbered):
        before = numbered[place - 1][2] if place else None
        after = numbered[place + 1][2] if place + 1 < len(numbered) else None
        killed = after is None and (before is None or isinstance(event, RoundStarted))
        if number not in (before, after) and not killed:
            yield index, f"an event of round {number} among those of round {after if before is None else before}"


def _is_goal(event: GoalStarted | Arrival | GoalFailed, manifest: Manifest) -> bool:
    if event.goal >= len(manifest.goals):
        return False
    goal = manifest.goals[event.goal]
    turn = abs(wrap_angle(event.target.theta - goal.theta))
    return math.hypot(event.target.x - goal.x, event.target.y - goal.y) < _SAME_PLACE and turn < _SAME_PLACE


def _with_beginnings(events: Sequence[Event], manifest: Manifest) -> Iterator[Event]:
    """The same, with the beginnings of rounds of which only later events can be read.

    Only a first round is ever a priming one: with map always, else if there are more rounds than count.
    """
    begun = {event.round for event in events if isinstance(event, RoundStarted)}
    numbers = {number for event in events if (number := getattr(event, "round", None)) is not None}
    primed = manifest.mode is Mode.WITH_MAP or max(numbers, default=0) >= manifest.rounds
    for event in events:
        number = getattr(event, "round", None)
        if number is not None and number not in begun:
            begun.add(number)
            yield RoundStarted(event.t, number, priming=number == 0 and primed)
        yield event


def _with_lost_arrivals(events: Sequence[Event], manifest: Manifest) -> tuple[list[Event], set[Cell]]:
    """The same, with arrivals without poses at goals that their round went past, and their cells."""
    ended = {(e.round, e.goal) for e in events if isinstance(e, Arrival | GoalFailed | GoalSkipped)}
    whole: list[Event] = []
    lost: set[Cell] = set()
    for event in events:
        past = 0
        if isinstance(event, GoalStarted | Arrival | GoalFailed):
            past = event.goal
        elif isinstance(event, RoundEnded) and event.outcome is Outcome.REACHED:
            past = len(manifest.goals)
        for goal in range(past):
            cell = getattr(event, "round", 0), goal
            if cell not in ended:
                ended.add(cell)
                lost.add(cell)
                whole.append(Arrival(event.t, cell[0], goal, manifest.goals[goal], None, None, None))
        whole.append(event)
    return whole, lost
