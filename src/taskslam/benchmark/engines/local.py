"""The engine of this machine: so many worker processes at a time, one run each.

What became of a run is judged by what stands on the disk: a worker that ended well and left no run has failed.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from threading import Lock, Thread
from typing import IO

from taskslam.benchmark.engine import Ending, Result, Watcher
from taskslam.benchmark.run import finished_run
from taskslam.benchmark.spec import RunSpec, run_folder
from taskslam.errors import InfrastructureError, InputError, MethodUnavailableError, RecordError
from taskslam.slam.cards import card_of

_LONGEST_LINE = 4096  # characters of a line of a worker; what is longer comes in pieces
_LAST_LINES = 20  # kept of what a worker complains
_PUTTING_AWAY_S = 15.0  # so long a worker that is told to stop may take


@dataclass(frozen=True)
class LocalEngine:
    """parallel: processes at a time. folders: where worlds and maps of the user's lie."""

    parallel: int = 1
    folders: tuple[Path, ...] = ()

    def run(self, specs: Sequence[RunSpec], out: Path, watcher: Watcher) -> Generator[Result, None, None]:
        """As `Engine.run`. Whoever stops in the middle closes the generator: then all workers end, and keep rounds."""
        heard, workers = _OneAtATime(watcher), _Workers()
        with ThreadPoolExecutor(max_workers=self.parallel) as pool:
            try:
                yield from pool.map(lambda spec: self._run(spec, out, heard, workers), specs)
            except BaseException:
                workers.stop()
                raise

    def _run(self, spec: RunSpec, out: Path, watcher: Watcher, workers: _Workers) -> Result:
        result = _without_driving(spec, out) or self._in_process(spec, out, watcher, workers)
        watcher.ends(result)
        return result

    def _in_process(self, spec: RunSpec, out: Path, watcher: Watcher, workers: _Workers) -> Result:
        watcher.begins(spec)
        order = {"spec": spec.to_json(), "out": str(out), "folders": [str(folder) for folder in self.folders]}
        said: dict[str, object] = {}
        with workers.started() as process:
            last_lines = _LastLines(process.stderr)
            assert process.stdin is not None
            with contextlib.suppress(BrokenPipeError):  # it is dead already, and its end is judged below
                process.stdin.write(json.dumps(order))
                process.stdin.close()
            for line in _lines(process.stdout):
                if progress := _progress(line):
                    said |= progress
                    watcher.goes_on(spec, progress)
            status = process.wait()
            complaint = str(said.get("complaint") or last_lines.last())
        return _judged(spec, out, status, complaint, str(said.get("notice", "")))


class _Workers:
    """The worker processes of one engine, so that all can be stopped."""

    def __init__(self) -> None:
        self._running: set[subprocess.Popen[str]] = set()
        self._lock = Lock()
        self._stopping = False

    @contextlib.contextmanager
    def started(self) -> Iterator[subprocess.Popen[str]]:
        """A new worker, waiting for its order."""
        command = [sys.executable, "-m", "taskslam.benchmark.engines.worker", str(os.getpid())]
        pipe = subprocess.PIPE
        with self._lock:
            process = subprocess.Popen(  # noqa: S603 our own interpreter and module
                command, stdin=pipe, stdout=pipe, stderr=pipe, encoding="utf-8", errors="replace"
            )
            self._running.add(process)
            if self._stopping:
                process.kill()
        try:
            with process:
                yield process
        finally:
            with self._lock:
                self._running.discard(process)

    def stop(self) -> None:
        """Ask every worker to put away what it is at, and end those that do not."""
        with self._lock:
            self._stopping = True
            running = list(self._running)
        for process in running:
            process.send_signal(signal.SIGTERM)
        deadline = time.monotonic() + _PUTTING_AWAY_S
        for process in running:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(max(0.0, deadline - time.monotonic()))
            process.kill()


class _LastLines(Thread):
    """Reads a stream to its end beside whoever reads another, and keeps its last lines."""

    def __init__(self, stream: IO[str] | None) -> None:
        super().__init__(daemon=True)
        self._stream = stream
        self._lines: deque[str] = deque(maxlen=_LAST_LINES)
        self.start()

    def run(self) -> None:
        """Until the stream ends."""
        for line in _lines(self._stream):
            if line.strip():
                self._lines.append(line.strip())

    def last(self) -> str:
        """The last line, once the stream has ended; or what there is after a second, if others hold it open."""
        self.join(timeout=1.0)
        return self._lines[-1] if self._lines else ""


def _lines(stream: IO[str] | None) -> Iterator[str]:
    assert stream is not None
    return iter(lambda: stream.readline(_LONGEST_LINE), "")


def _progress(line: str) -> dict[str, object]:
    """What a worker says in a line; nothing where it is no JSON object."""
    try:
        said = json.loads(line)
    except ValueError:
        return {}
    return said if isinstance(said, dict) else {}


def _judged(spec: RunSpec, out: Path, status: int, complaint: str, notice: str) -> Result:
    """The result of a run whose worker has ended with this status."""
    try:
        finished = finished_run(run_folder(out, spec), spec)
    except RecordError as error:
        return Result(spec.title, Ending.REFUSED, str(error), spec)
    if finished is not None:
        ending = Ending.COMPLETE if finished.complete else Ending.INCOMPLETE
        return Result(spec.title, ending, "" if finished.complete else finished.failure or notice, spec)
    if status == InputError.exit_status:
        return Result(spec.title, Ending.REFUSED, complaint, spec)
    if status == InfrastructureError.exit_status and complaint:
        return Result(spec.title, Ending.FAILED, complaint, spec)
    how = f"was killed by {signal.Signals(-status).name}" if status < 0 else f"ended with status {status}"
    more = f"; it said last: {complaint}" if complaint else ""
    return Result(spec.title, Ending.FAILED, f"its process {how} and left no finished run{more}", spec)


def _without_driving(spec: RunSpec, out: Path) -> Result | None:
    """The result of a run that is finished already, or cannot be driven; None of one that must be."""
    try:
        if finished_run(run_folder(out, spec), spec) is not None:
            return Result(spec.title, Ending.KEPT, "", spec)
    except RecordError as error:
        return Result(spec.title, Ending.REFUSED, str(error), spec)
    try:
        card_of(spec.method)
    except MethodUnavailableError:
        return Result(spec.title, Ending.UNAVAILABLE, f"{spec.method}: its package is not installed", spec)
    except InputError as error:
        return Result(spec.title, Ending.REFUSED, str(error), spec)
    return None


class _OneAtATime(Watcher):
    """Passes on what several threads say, one call at a time."""

    def __init__(self, watcher: Watcher) -> None:
        self._watcher = watcher
        self._lock = Lock()

    def begins(self, spec: RunSpec) -> None:
        with self._lock:
            self._watcher.begins(spec)

    def goes_on(self, spec: RunSpec, progress: dict[str, object]) -> None:
        with self._lock:
            self._watcher.goes_on(spec, progress)

    def ends(self, result: Result) -> None:
        with self._lock:
            self._watcher.ends(result)
