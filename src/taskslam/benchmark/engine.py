"""`Engine`: whatever drives many runs, on this machine or elsewhere; `Watcher`: who may listen to it.

An engine moves specs out and run directories back. What is finished already it keeps; what it cannot drive it names.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from taskslam.benchmark.spec import RunSpec


class Ending(StrEnum):
    """What became of a run."""

    COMPLETE = "complete"
    INCOMPLETE = "incomplete"
    KEPT = "finished before"
    SUBMITTED = "submitted"
    UNAVAILABLE = "method not installed"
    REFUSED = "refused"
    NOT_NEEDED = "not needed any more"
    FAILED = "infrastructure failed"


DRIVEN = frozenset({Ending.COMPLETE, Ending.INCOMPLETE, Ending.KEPT})
"""Of runs that are finished."""


@dataclass(frozen=True)
class Result:
    """What became of a run, with a sentence where it was not driven to its end. spec: None if there could be none."""

    title: str
    ending: Ending
    detail: str = ""
    spec: RunSpec | None = None


class Watcher:
    """Hears how many runs go; the null watcher hears nothing. Called from several threads, one call at a time."""

    def begins(self, spec: RunSpec) -> None:
        """A run starts."""

    def goes_on(self, spec: RunSpec, progress: dict[str, object]) -> None:
        """A line of progress from a run."""

    def ends(self, result: Result) -> None:
        """A run is over."""


class Engine(Protocol):
    """Drives runs, or hands them to a cluster's scheduler. Every spec has one result, whatever happens to it."""

    def run(self, specs: Sequence[RunSpec], out: Path, watcher: Watcher) -> Iterator[Result]:
        """Drive what is not finished under `out`; the results in the order of the specs.

        A run directory stands at `run_folder(out, spec)`, whole or not at all.
        """
