"""How far a campaign is, as the disk says it: any machine that sees the folder can ask, whoever drives."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from taskslam.benchmark.campaign.notes import Note, notes
from taskslam.benchmark.campaign.plan_file import campaign_folder
from taskslam.benchmark.spec import RunSpec, run_folder
from taskslam.record.newest import NEWEST
from taskslam.record.place import is_partial, partial_folder
from taskslam.record.run_directory import JOURNAL, MANIFEST, find_runs

_SILENT_S = 120.0  # a run that has said nothing for so long is taken for interrupted


class State(StrEnum):
    """Where a run is on its way."""

    FINISHED = "finished"
    UNDER_WAY = "under way"
    INTERRUPTED = "interrupted"
    NOT_DRIVEN = "could not be driven"
    WAITING = "waiting"


@dataclass(frozen=True)
class RunState:
    """A run and where it is; note: why it could not be driven, where that was said."""

    spec: RunSpec
    state: State
    note: Note | None = None


def states_of(specs: Sequence[RunSpec], out: Path) -> list[RunState]:
    """Where each run is. A finished one is not opened: whether it is this spec's, the next start looks."""
    said = notes(out)
    return [_state_of(spec, out, said) for spec in specs]


def unfinished(specs: Sequence[RunSpec], out: Path) -> list[RunSpec]:
    """Those without a finished run in their place, in their order."""
    return [spec for spec in specs if not (run_folder(out, spec) / MANIFEST).exists()]


def strangers(specs: Sequence[RunSpec], out: Path) -> list[Path]:
    """Finished runs under `out` that the plan does not mean, sorted: of another version of its file, as an example."""
    planned = {run_folder(out, spec) for spec in specs}
    kept = campaign_folder(out)
    return [folder for folder in find_runs(out) if folder not in planned and kept not in folder.parents]


def leftovers(specs: Sequence[RunSpec], out: Path) -> list[Path]:
    """Hidden folders of interrupted starts whose runs are finished by now, or are not planned; sorted."""
    open_places = {partial_folder(run_folder(out, spec)) for spec in unfinished(specs, out)}
    found = []
    for folder, subfolders, _ in os.walk(out):
        for name in list(subfolders):
            if name.startswith("."):
                subfolders.remove(name)
                place = Path(folder) / name
                if is_partial(place) and place not in open_places:
                    found.append(place)
    return sorted(found)


def where_is(folder: Path, note: Note | None = None) -> State:
    """How far the run is that stands at `folder`, or will. note: why it could not be driven, if that was said."""
    if (folder / MANIFEST).exists():
        return State.FINISHED
    signs = [_written(partial_folder(folder) / name) for name in (JOURNAL, NEWEST)]
    if signs[0] is None:
        return State.WAITING if note is None else State.NOT_DRIVEN
    # Written in the future: the clock was put back since then, and who drives would have written again by now.
    if min(abs(time.time() - sign) for sign in signs if sign is not None) < _SILENT_S:
        return State.UNDER_WAY
    return State.INTERRUPTED if note is None else State.NOT_DRIVEN


def _written(path: Path) -> float | None:
    """When a file was written last, s; None if it is not there."""
    try:
        return path.stat().st_mtime
    except OSError:
        return None


def _state_of(spec: RunSpec, out: Path, said: dict[str, Note]) -> RunState:
    note = said.get(spec.digest) if said else None
    state = where_is(run_folder(out, spec), note)
    return RunState(spec, state, None if state is State.FINISHED else note)
