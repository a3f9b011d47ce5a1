"""What an interrupted run leaves to the next start of the very same one: the rounds that had ended.

Without a map every round is a trial of its own, so what ended stays ended. A round counts from its line `round_ended`
in the journal, before which its trajectories and its tally were written; what came after the last such line goes.
"""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from taskslam.errors import RecordError
from taskslam.files import writing
from taskslam.outcomes import Outcome
from taskslam.reading import LARGEST_JOURNAL, LARGEST_MANIFEST, read_bytes
from taskslam.record.events import Event, GoalFailed, MethodNotice, RoundEnded, decode_event

TALLY = "tally.jsonl"


class Tally(BaseModel):
    """What a round took that its events do not say; a line of `tally.jsonl`, which goes when the run is finished.

    began_utc: when the run began, its first start; wall_s, compute_s: of this round; peak_bytes, cpu_s, stop_failure:
    of its method. dice: of a sealed run, what tells its noise from another's (`RunWriter`).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    round: int
    began_utc: str
    wall_s: float
    compute_s: float
    peak_bytes: int
    cpu_s: float = 0.0
    stop_failure: str = ""
    dice: str = ""


@dataclass(frozen=True)
class Resumption:
    """The rounds that ended; none where a run begins. journal_bytes: so much of the journal stays."""

    events: tuple[Event, ...] = ()
    tallies: tuple[Tally, ...] = ()
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
                failed = event.words(primed=False)  # rounds are resumed without a map alone
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

    @property
    def began_utc(self) -> str | None:
        """When the run began."""
        return self.tallies[0].began_utc if self.tallies else None

    @property
    def wall_s(self) -> float:
        """Wall time of the rounds."""
        return sum(tally.wall_s for tally in self.tallies)

    @property
    def compute_s(self) -> float:
        """The method's share of it, s of a processor."""
        return sum(tally.compute_s for tally in self.tallies)

    @property
    def cpu_s(self) -> float:
        """Processor time of all the method's processes."""
        return sum(tally.cpu_s for tally in self.tallies)

    @property
    def stop_failures(self) -> tuple[str, ...]:
        """How the method failed when it was stopped, by rounds."""
        return tuple(f"round {tally.round}: {tally.stop_failure}" for tally in self.tallies if tally.stop_failure)

    @property
    def peak_bytes(self) -> int:
        """Most memory resident in a process of the method."""
        return max((tally.peak_bytes for tally in self.tallies), default=0)


def read_resumption(journal: Path, tally: Path, dice: str = "") -> Resumption:
    """What the two files of an interrupted run leave; nothing where no round ended, or they do not fit together.

    dice: rounds with other noise do not count.
    """
    try:
        lines = read_bytes(journal, "journal", RecordError, LARGEST_JOURNAL).split(b"\n")[:-1]
        tallies = _read_tallies(tally)
    except RecordError:
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
            if ended.round != found.rounds or ended.round not in tallies or tallies[ended.round].dice != dice:
                break
            found = Resumption(tuple(events), (*found.tallies, tallies[ended.round]), size)
    return found


def add_tally(path: Path, tally: Tally) -> None:
    """Append a line. A link is not followed. Raises DiskFullError."""
    with writing(path):
        descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
        with os.fdopen(descriptor, "wb", buffering=0) as file:
            file.write(tally.model_dump_json().encode() + b"\n")


def _read_tallies(path: Path) -> dict[int, Tally]:
    """The last line of each round: one that was driven again has two. A line that was cut off is passed over."""
    tallies = {}
    for line in read_bytes(path, "tally", RecordError, LARGEST_MANIFEST).split(b"\n"):
        with contextlib.suppress(ValidationError):
            tally = Tally.model_validate_json(line)
            tallies[tally.round] = tally
    return tallies
