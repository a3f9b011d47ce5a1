"""The run directory: plain files that the field already reads, whole or absent (design D7).

    run.json          what was run (`Manifest`)
    journal.jsonl     what happened, one event a line
    method.log        what the method printed
    round00/          truth.tum, estimate.tum, odometry.tum of each round, in the frame `map`; frames.txt: how long
                      the method took over each frame
    plan.yaml, .png   the floor plan
    spec.json         the run as one value, from which it can be driven again

Trajectories of a finished run may be compressed (`compression.py`): truth.tum.gz.

While a run is under way it lives in a hidden folder beside its place, `.<name>.partial`, which is renamed at the end;
one process at a time writes it (`run_lock.py`). What an interrupted one leaves, the next start goes on with where it
can (`resumption.py`), and removes otherwise. Nothing is written through a link. A cluster may take a machine for dead
that is not, and start its work elsewhere: each start puts its name into the folder, and whoever finds another there
before a round is written, or the run is put in its place, has been replaced and writes no more.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import secrets
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from pydantic import ValidationError

from taskslam.errors import RecordError
from taskslam.files import remove, write_whole, writing
from taskslam.geometry import SE2, FloatArray
from taskslam.reading import LARGEST_JOURNAL, LARGEST_MANIFEST, is_there, read_bytes, read_json, read_text
from taskslam.record.compression import plain_or_compressed
from taskslam.record.digests import changed_files, digests
from taskslam.record.events import Event, RoundEnded, RoundStarted
from taskslam.record.frame_times import FRAMES, NO_FRAMES, FrameTimes, read_frame_times, write_frame_times
from taskslam.record.journal import JournalWriter, read_journal, read_lines
from taskslam.record.manifest import MANIFEST_FILE, RUN_FORMAT, Manifest
from taskslam.record.newest import Newest, few, with_way, write_newest
from taskslam.record.place import (
    WRITER,
    is_partial,
    is_plain,
    is_taken,
    move_into_place,
    partial_folder,
    settle_locked,
)
from taskslam.record.resumption import TALLY, Resumption, Tally, add_tally, read_resumption
from taskslam.record.run_lock import RunLock
from taskslam.record.salvage import salvage
from taskslam.record.trajectories import SpatialTrajectory, Trajectory, read_trajectory, write_trajectory

MANIFEST, JOURNAL, METHOD_LOG, SPEC = MANIFEST_FILE, "journal.jsonl", "method.log", "spec.json"
PoseName: TypeAlias = Literal["truth", "estimate", "odometry"]
POSE_NAMES: tuple[PoseName, ...] = get_args(PoseName)
_SHOWN_EVERY = 1.0  # s of a clock between two states for whoever watches


class RunWriter:
    """Writes one run. Use as a context manager; without `finish` the partial folder stays, with all that was measured.

    with RunWriter(Path("results/house-karto")) as run:
        run.event(RoundStarted(0, 0, priming=False))
        run.pose("truth", 0, stamp, SE2(1.0, 2.0, 0.5))
        ...
        run.finish(manifest)
    """

    def __init__(
        self,
        directory: Path,
        replace: bool = False,
        spec: str | None = None,
        resume: bool = False,
        dice: str = "",
        take_over: bool = False,
    ) -> None:
        """Begin a run that will stand at `directory`, or go on with what an interrupted start left of it.

        replace: a finished run at `directory` is replaced when this one finishes. spec: the run as one value, for
        spec.json. resume: rounds of the very same spec that had ended are kept: then `resumed` tells of them. dice: of
        a sealed run, a word that tells its noise from another's, and from which that cannot be had. take_over: a lock
        that somebody holds is no reason to wait, since whoever starts this knows that the holder is to be replaced.
        notice: what became of an interrupted start, empty where there was none. began_utc: ISO 8601, when the run
        began: its first start; may be set before a round ends.

        Raises RecordError if the directory exists and `replace` is not set, or if another process is writing it;
        DiskFullError if the place is not writable.
        """
        self.directory = directory.absolute()
        self.folder = partial_folder(self.directory)
        self.resumed, self.notice = Resumption(), ""
        self._replace, self._dice = replace, dice
        self._poses: dict[tuple[int, PoseName], list[tuple[int, SE2 | FloatArray]]] = {}
        self._frames: dict[int, list[tuple[int, int, int]]] = {}
        self._measured = False
        self._finished = False
        with writing(self.directory):
            self.directory.parent.mkdir(parents=True, exist_ok=True)
        self._lock = None if take_over else RunLock(self.directory)
        try:
            settle_locked(self.directory)
            if not replace and is_taken(self.directory):
                raise RecordError(f"{self.directory}: exists already; expected the name of a new folder for this run")
            with writing(self.directory):
                self._take_over(spec, resume)
            self._name = secrets.token_hex(16)
            write_whole(self.folder / WRITER, self._name)
            self._journal = JournalWriter(self.folder / JOURNAL, self.resumed.journal_bytes)
            if spec is not None:
                write_whole(self.folder / SPEC, spec + "\n")
        except BaseException:
            self._release()
            raise
        self._written = set(range(self.resumed.rounds))
        self._resumable = resume
        self.began_utc = self.resumed.began_utc or datetime.now(UTC).isoformat()
        self._round_began = time.perf_counter()
        self._shown = -math.inf

    def _take_over(self, spec: str | None, resume: bool) -> None:
        """Keep of an interrupted start the rounds that ended, if it was of this spec; remove what else it left."""
        if self.folder.is_dir():
            same = spec is not None and is_plain(self.folder) and _text(self.folder / SPEC) == spec + "\n"
            if same and resume:
                self.resumed = read_resumption(self.folder / JOURNAL, self.folder / TALLY, self._dice)
            self.notice = _what_became(self.directory, self.resumed.rounds, same, resume)
        if not self.resumed.rounds:
            remove(self.folder)
            self.folder.mkdir()
            return
        for path in self.folder.iterdir():
            if path not in {round_folder(self.folder, number) for number in range(self.resumed.rounds)} and (
                path.name not in {JOURNAL, TALLY, METHOD_LOG}
            ):
                remove(path)
        # A new file, so that a replaced writer, who has the old one open, adds nothing to it.
        journal = read_bytes(self.folder / JOURNAL, "journal", RecordError, LARGEST_JOURNAL)
        write_whole(self.folder / JOURNAL, journal[: self.resumed.journal_bytes])

    @property
    def method_log(self) -> Path:
        """Where the host writes what the method prints; it moves with the folder at the end."""
        return self.folder / METHOD_LOG

    def event(self, event: Event) -> None:
        """Append an event to the journal; before `RoundEnded` the round's trajectories are written.

        Raises DiskFullError; RecordError if another start has taken over.
        """
        if isinstance(event, RoundEnded):
            self._check_writer()
            self._write_round(event.round)
        self._measured |= not isinstance(event, RoundStarted)
        self._journal.write(event)

    def tally(self, number: int, compute_s: float, peak_bytes: int, cpu_s: float = 0.0, stop_failure: str = "") -> None:
        """Remember, before round `number` ends, what it took of the method: for whoever must go on after it.

        Raises DiskFullError; RecordError if another start has taken over.
        """
        self._check_writer()
        now = time.perf_counter()
        wall_s, self._round_began = now - self._round_began, now
        add_tally(
            self.folder / TALLY,
            Tally(
                round=number,
                began_utc=self.began_utc,
                wall_s=wall_s,
                compute_s=compute_s,
                peak_bytes=peak_bytes,
                cpu_s=cpu_s,
                stop_failure=stop_failure,
                dice=self._dice,
            ),
        )

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
        self._measured = True
        self._poses.setdefault((round, name), []).append((stamp, pose))

    def show(self, state: Callable[[], Newest]) -> None:
        """Leave the newest state for whoever watches (`newest.py`), if a second has passed since the last one.

        state: asked for it then, without the way, which is known here. The clock decides nothing else.
        """
        clock = time.perf_counter()
        if clock - self._shown < _SHOWN_EVERY or not self._is_ours():
            return
        self._shown = clock
        newest = state()
        names: tuple[PoseName, ...] = ("truth", "estimate", "odometry")
        rows = next((rows for name in names if (rows := self._poses.get((newest.round, name)))), [])
        write_newest(self.folder, with_way(newest, [pose for _, pose in few(rows)]))

    def frames(self, round: int, rows: Iterable[tuple[int, int, int]]) -> None:  # noqa: A002 its word
        """Remember (stamp, compute, latency) of frames that the method answered, in ns, for the round's frames.txt."""
        if round not in self._written:
            self._frames.setdefault(round, []).extend(rows)

    def finish(self, manifest: Manifest | Mapping[str, Any]) -> Path:
        """Write run.json and put the whole run in its place. Returns the run directory.

        Raises RecordError if the manifest is not valid or another start has taken over, DiskFullError if it cannot be
        written.
        """
        self._check_writer()
        checked = validate_manifest(manifest, self.folder / MANIFEST)
        self._write_open_rounds()
        self._journal.close()
        with writing(self.folder):
            checked = checked.model_copy(update={"files": digests(self.folder)})
        write_whole(self.folder / MANIFEST, _json(checked.model_dump(mode="json")))
        move_into_place(self.folder, self.directory, self._replace)
        self._finished = True
        self._release()
        return self.directory

    def __enter__(self) -> RunWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        try:
            if not self._finished and self._is_ours():
                self._leave(error)
        finally:
            self._release()

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.release()

    def _is_ours(self) -> bool:
        return _text(self.folder / WRITER) == self._name

    def _check_writer(self) -> None:
        if self._finished or self._is_ours():
            return
        self._finished = True  # nothing of it is ours to write any more
        raise RecordError(f"{self.directory}: another start of this run has taken over; this one writes no more")

    def _leave(self, error: BaseException | None) -> None:
        if error is None:
            self._write_open_rounds()
            self._journal.close()
            return
        # The first failure is the one to report: saving the rest is a best effort that must not hide it.
        ended = len(self._written)
        with contextlib.suppress(Exception):
            self._write_open_rounds()
        with contextlib.suppress(Exception):
            self._journal.close()
        if not self._measured and not ended:
            self._leave_nothing(error)
            return
        more = f": {_rounds(ended)} ended, after which the next start goes on" if self._resumable and ended else ""
        error.add_note(f"What was measured so far is kept in {self.folder}{more}")

    def _leave_nothing(self, error: BaseException) -> None:
        """Nothing was measured: all that is worth keeping is what a method printed that would not start."""
        with contextlib.suppress(OSError):
            if self.method_log.stat().st_size:
                error.add_note(f"What the method printed is kept in {self.method_log}")
                return
        with contextlib.suppress(OSError):
            remove(self.folder)

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
        if frames := self._frames.pop(number, []):
            write_frame_times(folder / FRAMES, frames)
        for name in POSE_NAMES:
            self._poses.pop((number, name), None)
        self._written.add(number)


@dataclass(frozen=True)
class RunRecord:
    """A finished run, read back. truncated: the journal's last line was cut off.

    damaged: a sentence for every line of the journal that could not be used; lost: rounds and goals of arrivals that
    went with them (`salvage.py`). changed: a sentence for every file that is not as run.json says that it was written.
    """

    directory: Path
    manifest: Manifest
    events: tuple[Event, ...]
    truncated: bool = False
    damaged: tuple[str, ...] = ()
    lost: frozenset[tuple[int, int]] = frozenset()
    changed: tuple[str, ...] = ()

    def rounds(self) -> tuple[RoundStarted, ...]:
        """The rounds that were begun, in order, the priming round included."""
        return tuple(event for event in self.events if isinstance(event, RoundStarted))

    def trajectory(self, round: int, name: PoseName) -> Trajectory:  # noqa: A002 the protocol's word
        """A round's trajectory in `map`; empty if none was recorded. Raises RecordError if the file is damaged."""
        path = plain_or_compressed(round_folder(self.directory, round) / f"{name}.tum")
        if not path.exists():
            return Trajectory(np.empty(0, dtype=np.int64), np.empty((0, 3)))
        return read_trajectory(path)

    def frame_times(self, round: int) -> FrameTimes:  # noqa: A002 the protocol's word
        """How long the method took over a round's frames; empty if that was not kept. Raises RecordError if damaged."""
        path = round_folder(self.directory, round) / FRAMES
        return read_frame_times(path) if is_there(path) else NO_FRAMES


def load_manifest(directory: Path) -> Manifest:
    """What a run was, without what happened in it. Raises RecordError as `load_run`."""
    path = directory / MANIFEST
    if not is_there(path):
        if is_there(directory / JOURNAL):
            raise RecordError(f"{directory}: half-written: it has a journal but no {MANIFEST}")
        raise RecordError(f"{directory}: not a run directory; expected a folder that holds {MANIFEST}")
    return validate_manifest(read_json(path, "run", RecordError, LARGEST_MANIFEST), path)


def load_run(directory: Path, damaged: bool = False) -> RunRecord:
    """Read a run directory. Raises RecordError naming the file, the place in it and what was expected.

    damaged: whether to take a journal with damaged lines, make the best of it, and compare files with their digests.
    """
    manifest = load_manifest(directory)
    if not damaged:
        journal = read_journal(directory / JOURNAL)
        return RunRecord(directory, manifest, journal.events, journal.truncated)
    lines, truncated = read_lines(directory / JOURNAL)
    found = salvage(lines, manifest, directory / JOURNAL)
    changed = changed_files(directory, manifest.files)
    return RunRecord(directory, manifest, found.events, truncated, found.damaged, found.lost, changed)


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
        hidden = is_partial(Path(folder))
        if JOURNAL in files or (MANIFEST in files and not hidden):
            found.append((Path(folder), MANIFEST in files and not hidden))
            subfolders.clear()
    return found


def _what_became(directory: Path, kept: int, same: bool, resume: bool) -> str:
    if kept:
        return f"{directory}: interrupted before; goes on after {_rounds(kept)} that ended"
    why = (
        "it was of another configuration or version"
        if not same
        else "no round of it had ended"
        if resume
        else "its rounds are one lifetime of the method"
    )
    return f"{directory}: an interrupted start is removed, and the run begins anew: {why}"


def _rounds(count: int) -> str:
    return "1 round" if count == 1 else f"{count} rounds"


def _text(path: Path) -> str | None:
    try:
        return read_text(path, "run's spec", RecordError, LARGEST_MANIFEST)
    except RecordError:
        return None


def _json(content: object) -> str:
    return json.dumps(content, sort_keys=True, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
