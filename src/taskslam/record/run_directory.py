"""The run directory: plain files that the field already reads, whole or absent (design D7).

    run.json          what was run (`Manifest`)
    journal.jsonl     what happened, one event a line
    method.log        what the method printed
    round00/          truth.tum, estimate.tum, odometry.tum of each round, in the frame `map`
    plan.yaml, .png   the floor plan

While a run is under way it lives in a hidden folder beside its place, `.<name>.partial`, which is renamed at the end.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from pydantic import ValidationError

from taskslam.errors import RecordError
from taskslam.files import sync_folder, write_whole, writing
from taskslam.geometry import SE2, FloatArray
from taskslam.reading import LARGEST_MANIFEST, is_there, read_json
from taskslam.record.events import Event, RoundEnded, RoundStarted
from taskslam.record.journal import JournalWriter, read_journal, read_lines
from taskslam.record.manifest import RUN_FORMAT, Manifest
from taskslam.record.salvage import salvage
from taskslam.record.trajectories import SpatialTrajectory, Trajectory, read_trajectory, write_trajectory

MANIFEST, JOURNAL, METHOD_LOG = "run.json", "journal.jsonl", "method.log"
PoseName: TypeAlias = Literal["truth", "estimate", "odometry"]
POSE_NAMES: tuple[PoseName, ...] = get_args(PoseName)


class RunWriter:
    """Writes one run. Use as a context manager; without `finish` the partial folder stays, with all that was measured.

    with RunWriter(Path("results/house-karto")) as run:
        run.event(RoundStarted(0, 0, priming=False))
        run.pose("truth", 0, stamp, SE2(1.0, 2.0, 0.5))
        ...
        run.finish(manifest)
    """

    def __init__(self, directory: Path, replace: bool = False) -> None:
        """Begin a run that will stand at `directory`; what a killed run left there half-written is removed.

        replace: a finished run at `directory` is replaced when this one finishes. Raises RecordError if it exists and
        `replace` is not set, or if another process is writing it; DiskFullError if the place is not writable.
        """
        self.directory = directory.absolute()
        self.folder = partial_folder(self.directory)
        self._replace = replace
        self._poses: dict[tuple[int, PoseName], list[tuple[int, SE2 | FloatArray]]] = {}
        self._written: set[int] = set()
        self._finished = False
        if not replace and (self.directory.is_file() or (self.directory.is_dir() and any(self.directory.iterdir()))):
            raise RecordError(f"{self.directory}: exists already; expected the name of a new folder for this run")
        with writing(self.directory):
            self.directory.parent.mkdir(parents=True, exist_ok=True)
            if self.folder.exists():
                _refuse_if_in_use(self.folder)
                shutil.rmtree(self.folder)
            self.folder.mkdir()
        self._journal = JournalWriter(self.folder / JOURNAL)

    @property
    def method_log(self) -> Path:
        """Where the host writes what the method prints; it moves with the folder at the end."""
        return self.folder / METHOD_LOG

    def event(self, event: Event) -> None:
        """Append an event to the journal; `RoundEnded` also writes the round's trajectories. Raises DiskFullError."""
        self._journal.write(event)
        if isinstance(event, RoundEnded):
            self._write_round(event.round)

    def pose(self, name: PoseName, round: int, stamp: int, pose: SE2 | FloatArray) -> None:  # noqa: A002 its word
        """Remember a pose in `map` at an instant (ns) for the round's trajectory file.

        pose: planar, or (4, 4) in space; a trajectory's poses are all of one kind. Raises RecordError if it is not
        finite or if the round has ended.
        """
        if name not in POSE_NAMES:
            raise RecordError(f"unknown trajectory {name!r}; expected one of {', '.join(POSE_NAMES)}")
        if round in self._written:
            raise RecordError(f"a pose for round {round}, which has ended; expected a round that is under way")
        if not (pose.is_finite() if isinstance(pose, SE2) else np.isfinite(pose).all()):
            raise RecordError(f"round {round}, {name} at {stamp} ns: expected a finite pose, found {pose}")
        self._poses.setdefault((round, name), []).append((stamp, pose))

    def finish(self, manifest: Manifest | Mapping[str, Any]) -> Path:
        """Write run.json and put the whole run in its place. Returns the run directory.

        Raises RecordError if the manifest is not valid, DiskFullError if it cannot be written.
        """
        checked = validate_manifest(manifest, self.folder / MANIFEST)
        self._write_open_rounds()
        self._journal.close()
        write_whole(self.folder / MANIFEST, _json(checked.model_dump(mode="json")))
        with writing(self.folder):
            _sync_tree(self.folder)
        _move_into_place(self.folder, self.directory, self._replace)
        self._finished = True
        return self.directory

    def __enter__(self) -> RunWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        if self._finished:
            return
        if error is None:
            self._write_open_rounds()
            self._journal.close()
            return
        # The first failure is the one to report: saving the rest is a best effort that must not hide it.
        with contextlib.suppress(Exception):
            self._write_open_rounds()
        with contextlib.suppress(Exception):
            self._journal.close()
        error.add_note(f"What was measured so far is kept in {self.folder}")

    def _write_open_rounds(self) -> None:
        for number in sorted({key[0] for key in self._poses}):
            self._write_round(number)

    def _write_round(self, number: int) -> None:
        folder = round_folder(self.folder, number)
        with writing(folder):
            folder.mkdir(exist_ok=True)
        for name in POSE_NAMES:
            rows = self._poses.get((number, name))
            if rows:
                write_trajectory(folder / f"{name}.tum", _trajectory(rows))
        for name in POSE_NAMES:
            self._poses.pop((number, name), None)
        self._written.add(number)


@dataclass(frozen=True)
class RunRecord:
    """A finished run, read back. truncated: the journal's last line was cut off.

    damaged: a sentence for every line of the journal that could not be used; lost: rounds and goals of arrivals that
    went with them (`salvage.py`).
    """

    directory: Path
    manifest: Manifest
    events: tuple[Event, ...]
    truncated: bool = False
    damaged: tuple[str, ...] = ()
    lost: frozenset[tuple[int, int]] = frozenset()

    def rounds(self) -> tuple[RoundStarted, ...]:
        """The rounds that were begun, in order, the priming round included."""
        return tuple(event for event in self.events if isinstance(event, RoundStarted))

    def trajectory(self, round: int, name: PoseName) -> Trajectory:  # noqa: A002 the protocol's word
        """A round's trajectory in `map`; empty if none was recorded. Raises RecordError if the file is damaged."""
        path = round_folder(self.directory, round) / f"{name}.tum"
        if not path.exists():
            return Trajectory(np.empty(0, dtype=np.int64), np.empty((0, 3)))
        return read_trajectory(path)


def load_run(directory: Path, damaged: bool = False) -> RunRecord:
    """Read a run directory. Raises RecordError naming the file, the place in it and what was expected.

    damaged: whether to take a journal with damaged lines, and make the best of it.
    """
    path = directory / MANIFEST
    if not is_there(path):
        if is_there(directory / JOURNAL):
            raise RecordError(f"{directory}: half-written: it has a journal but no {MANIFEST}")
        raise RecordError(f"{directory}: not a run directory; expected a folder that holds {MANIFEST}")
    manifest = validate_manifest(read_json(path, "run", RecordError, LARGEST_MANIFEST), path)
    if not damaged:
        journal = read_journal(directory / JOURNAL)
        return RunRecord(directory, manifest, journal.events, journal.truncated)
    lines, truncated = read_lines(directory / JOURNAL)
    found = salvage(lines, manifest, directory / JOURNAL)
    return RunRecord(directory, manifest, found.events, truncated, found.damaged, found.lost)


def validate_manifest(content: object, path: Path) -> Manifest:
    """The manifest, checked. Raises RecordError naming every wrong key and what was expected there."""
    if isinstance(content, Manifest):
        return content
    if isinstance(content, Mapping) and content.get("format", RUN_FORMAT) != RUN_FORMAT:
        raise RecordError(f"{path}: format {content['format']!r}; this version reads {RUN_FORMAT!r}")
    try:
        # Through JSON mode, so that lists stand for tuples in a file and in a dict alike.
        return Manifest.model_validate(content)
    except ValidationError as error:
        faults = "; ".join(
            f"{'.'.join(map(str, fault['loc']))}: {' '.join(fault['msg'].split())}" for fault in error.errors()
        )
        raise RecordError(f"{path}: {faults}") from None


def find_runs(directory: Path) -> list[Path]:
    """All finished run directories at or below a folder, sorted by path."""
    return sorted(folder for folder, whole in _walk(directory) if whole)


def find_partial_runs(directory: Path) -> list[Path]:
    """Folders at or below `directory` that a run left half-written: a journal without run.json."""
    return sorted(folder for folder, whole in _walk(directory) if not whole)


def partial_folder(directory: Path) -> Path:
    """Where a run lives until it is finished."""
    return directory.with_name(f".{directory.name}.partial")


def round_folder(directory: Path, round: int) -> Path:  # noqa: A002 the protocol's word
    """Where a round's trajectories stand."""
    return directory / f"round{round:02d}"


def _trajectory(rows: list[tuple[int, SE2 | FloatArray]]) -> Trajectory | SpatialTrajectory:
    stamps = np.array([stamp for stamp, _ in rows], dtype=np.int64)
    if isinstance(rows[0][1], SE2):
        return Trajectory(stamps, np.array([(at.x, at.y, at.theta) for _, at in rows if isinstance(at, SE2)]))
    return SpatialTrajectory.from_matrices(stamps, np.array([at for _, at in rows]))


def _walk(directory: Path) -> list[tuple[Path, bool]]:
    found = []
    for folder, subfolders, files in os.walk(directory):
        hidden = Path(folder).name.startswith(".") and Path(folder).name.endswith(".partial")
        if JOURNAL in files or (MANIFEST in files and not hidden):
            found.append((Path(folder), MANIFEST in files and not hidden))
            subfolders.clear()
    return found


def _refuse_if_in_use(folder: Path) -> None:
    """A lock on the journal dies with the process that writes it, so a killed run never blocks the next one."""
    try:
        with (folder / JOURNAL).open("rb") as journal:
            fcntl.flock(journal, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except FileNotFoundError:
        return
    except BlockingIOError:
        raise RecordError(
            f"{folder}: another process is writing this run; wait for it or name another folder"
        ) from None


def _move_into_place(folder: Path, directory: Path, replace: bool) -> None:
    with writing(directory):
        if replace and directory.exists():
            old = directory.with_name(f".{directory.name}.replaced")
            if old.exists():
                shutil.rmtree(old)
            directory.rename(old)
            folder.rename(directory)
            shutil.rmtree(old)
        else:
            folder.rename(directory)
        sync_folder(directory.parent)


def _sync_tree(folder: Path) -> None:
    for place, _, files in os.walk(folder):
        for name in files:
            descriptor = os.open(Path(place) / name, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
        sync_folder(Path(place))


def _json(content: object) -> str:
    return json.dumps(content, sort_keys=True, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
