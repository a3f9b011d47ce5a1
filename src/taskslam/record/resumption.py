"""What an interrupted run leaves to the next start of the very same one: the rounds that had ended.

Without a map every round is a trial of its own, so what ended stays ended. A round counts from its line `round_ended`
in the journal, before which its trajectories and its tally were written; what came after the last such line goes.
"""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from taskslam.errors import RecordError
from taskslam.files import writing
from taskslam.outcomes import Outcome
from taskslam.record.events import Event, GoalFailed, MethodNotice, RoundEnded, decode_event

TALLY = "tally.jsonl"


class Totals(BaseModel):
    """What the rounds up to one have taken that events do not say; a line of `tally.jsonl`, gone with the run's end.

    round: the last of them; began_utc: when the run began, with its first start; wall_s; compute_s, cpu_s, peak_bytes:
    of the method, as run.json has them; stop_failures: how it failed while it was stopped. key: what else must be the
    same for rounds of two starts to belong together.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    round: int = -1
    began_utc: str = ""
    wall_s: float = 0.0
    compute_s: float = 0.0
    cpu_s: float = 0.0
    peak_bytes: int = 0
    stop_failures: tuple[str, ...] = ()
    key: str = ""


@dataclass(frozen=True)
class Resumption:
    """The rounds that ended; none where a run begins. journal_bytes: so much of the journal stays."""

    events: tuple[Event, ...] = ()
    totals: Totals = field(default_factory=Totals)
    journal_bytes: int = 0

    @property
    def ended(self) -> tuple[RoundEnded, ...]:
        """How each of them ended, in order."""
        return tuple(event for event in self.events if isinstance(event, RoundEnded))

    @property
    def rounds(self) -> int:
        """How many there are: the number of the next."""
        return len(self.ended)

    @property
    def now(self) -> int:
        """Simulated time at the end of the last, ns."""
        return self.ended[-1].t if self.ended else 0

    @property
    def complete(self) -> bool:
        """Whether every goal was reached."""
        return all(event.outcome is Outcome.REACHED for event in self.ended)

    @property
    def failure(self) -> str | None:
        """The last failure, in a sentence; in a replay, which has no goals, what was said of the method."""
        failed: str | None = None
        said = ""
        for event in self.events:
            if isinstance(event, GoalFailed):
                failed = event.words
            elif isinstance(event, MethodNotice):
                said = f"round {event.round}: {event.text}"
            elif isinstance(event, RoundEnded) and event.outcome is not Outcome.REACHED and failed is None:
                failed = said
        return failed

    @property
    def frames(self) -> int:
        """Sensor frames offered to the method."""
        return sum(event.frames for event in self.ended)

    @property
    def dropped_frames(self) -> int:
        """Those that it never saw."""
        return sum(event.dropped_frames for event in self.ended)


def read_resumption(journal: Path, tally: Path, key: str) -> Resumption:
    """What the two files of an interrupted run leave; nothing where no round ended, or they do not fit together."""
    try:
        lines, tallies = journal.read_bytes().split(b"\n")[:-1], _read_tallies(tally)
    except OSError:
        return Resumption()
    events: list[Event] = []
    found, size = Resumption(), 0
    for line in lines:
        try:
            events.append(decode_event(line))
        except RecordError:
            break
        size += len(line) + 1
        if isinstance(ended := events[-1], RoundEnded):
            totals = tallies.get(ended.round)
            if ended.round != found.rounds or totals is None or totals.key != key:
                break
            found = Resumption(tuple(events), totals, size)
    return found


def add_tally(path: Path, totals: Totals) -> None:
    """Append a line. A link is not followed. Raises DiskFullError."""
    with writing(path):
        descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
        with os.fdopen(descriptor, "wb", buffering=0) as file:
            file.write(totals.model_dump_json().encode() + b"\n")


def _read_tallies(path: Path) -> dict[int, Totals]:
    """By round, the last line of each: one that was driven again has more. A line that was cut off is passed over."""
    tallies = {}
    for line in path.read_bytes().split(b"\n"):
        with contextlib.suppress(ValidationError):
            totals = Totals.model_validate_json(line)
            tallies[totals.round] = totals
    return tallies
