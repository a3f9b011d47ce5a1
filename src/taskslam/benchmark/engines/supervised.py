"""One run in a worker process, watched until it ends: what every engine does with a spec in the end, wherever that is.

What became of a run is judged by what stands on the disk: a worker that ended well and left no run has failed. One that
was killed, by its method or for want of memory as examples, is tried again: no method is blamed for that.
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
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from threading import Lock, Thread
from typing import IO

from taskslam.benchmark.engine import Ending, Result, Watcher
from taskslam.benchmark.run import finished_run
from taskslam.benchmark.spec import RunSpec, run_folder
from taskslam.errors import InfrastructureError, InputError, MethodUnavailableError, TaskSlamError
from taskslam.processes.guest import SINGLE_THREADED
from taskslam.record.manifest import Manifest
from taskslam.record.place import settle
from taskslam.slam.cards import card_of

_TRIES = 3  # of a run whose worker dies
_LONGEST_LINE = 4096  # characters of a line of a worker; what is longer comes in pieces
_LAST_LINES = 20  # kept of what a worker complains
_PUTTING_AWAY_S = 15.0  # so long a worker that is told to stop may take


@dataclass(frozen=True)
class Order:
    """A run to be driven in a process of its own.

    folders: where worlds and maps of the user's lie. threads: that libraries may use; cores: to be kept on, empty for
    any. salt: of a sealed run whose secret is elsewhere. take_over: as of `benchmark.run.run`.
    """

    spec: RunSpec
    out: Path
    folders: tuple[Path, ...] = ()
    threads: int = 1
    cores: frozenset[int] = frozenset()
    salt: str | None = None
    take_over: bool = False

    def to_json(self) -> str:
        """As the worker reads it."""
        return json.dumps(
            {
                "spec": self.spec.to_json(),
                "out": str(self.out),
                "folders": [str(folder) for folder in self.folders],
                "salt": self.salt,
                "take_over": self.take_over,
            }
        )


class Workers:
    """The worker processes of one engine, so that all can be stopped."""

    def __init__(self) -> None:
        self._running: set[subprocess.Popen[str]] = set()
        self._lock = Lock()
        self.stopping = False

    @contextlib.contextmanager
    def started(self, threads: int = 1, cores: frozenset[int] = frozenset()) -> Iterator[subprocess.Popen[str]]:
        """A new worker, waiting for its order."""
        command = [sys.executable, "-m", "taskslam.benchmark.engines.worker", str(os.getpid())]
        environment = os.environ | dict.fromkeys(SINGLE_THREADED, str(threads))
        pipe = subprocess.PIPE
        with self._lock:
            process = subprocess.Popen(  # noqa: S603 our own interpreter and module
                command, stdin=pipe, stdout=pipe, stderr=pipe, encoding="utf-8", errors="replace", env=environment
            )
            self._running.add(process)
            if self.stopping:
                process.kill()
        if cores:
            with contextlib.suppress(OSError):  # it is dead already, and its end is judged
                os.sched_setaffinity(process.pid, cores)  # before it has a second thread
        try:
            with process:
                yield process
        finally:
            with self._lock:
                self._running.discard(process)

    def stop(self) -> None:
        """Ask every worker to put away what it is at, and end those that do not."""
        with self._lock:
            self.stopping = True
            running = list(self._running)
        for process in running:
            process.send_signal(signal.SIGTERM)
        deadline = time.monotonic() + _PUTTING_AWAY_S
        for process in running:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(max(0.0, deadline - time.monotonic()))
            process.kill()


def kept(spec: RunSpec, out: Path) -> Result | None:
    """The result of a run that is finished already, or whose place is taken; None of one that is not there."""
    try:
        finished = _settled(spec, out)
    except TaskSlamError as error:
        return Result(spec.title, _ending_by(error), str(error), spec)
    return None if finished is None else Result(spec.title, Ending.KEPT, "", spec)


def without_driving(spec: RunSpec, out: Path) -> Result | None:
    """The result of a run that is finished already, or cannot be driven here; None of one that must be."""
    if (result := kept(spec, out)) is not None:
        return result
    try:
        card_of(spec.method)
    except MethodUnavailableError:
        return Result(spec.title, Ending.UNAVAILABLE, f"{spec.method}: its package is not installed", spec)
    except InputError as error:
        return Result(spec.title, Ending.REFUSED, str(error), spec)
    return None


def drive(order: Order, watcher: Watcher, workers: Workers) -> Result:
    """Drive a run that must be driven; tried again where its worker dies."""
    for attempt in range(_TRIES):
        result, died = _attempt(order, watcher, workers)
        if not died or workers.stopping or attempt == _TRIES - 1:
            return result
    raise AssertionError("unreachable: the last attempt returns")


def _attempt(order: Order, watcher: Watcher, workers: Workers) -> tuple[Result, bool]:
    """What became of it, and whether its worker died without a word about why."""
    said: dict[str, object] = {}
    with workers.started(order.threads, order.cores) as process:
        last_lines = _LastLines(process.stderr)
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it is dead already, and its end is judged below
            process.stdin.write(order.to_json())
            process.stdin.close()
        for line in _lines(process.stdout):
            if progress := _progress(line):
                said |= progress
                watcher.goes_on(order.spec, progress)
        status = process.wait()
        complaint = str(said.get("complaint") or last_lines.last())
    return _judged(order, status, complaint, str(said.get("notice", "")))


def _judged(order: Order, status: int, complaint: str, notice: str) -> tuple[Result, bool]:
    """The result of a run whose worker has ended with this status, and whether it died."""
    spec = order.spec
    try:
        finished = _settled(spec, order.out)
    except TaskSlamError as error:
        return Result(spec.title, _ending_by(error), str(error), spec), False
    if finished is not None:
        ending = Ending.COMPLETE if finished.complete else Ending.INCOMPLETE
        return Result(spec.title, ending, "" if finished.complete else finished.failure or notice, spec), False
    if status == InputError.exit_status:
        return Result(spec.title, Ending.REFUSED, complaint or "its worker said no reason", spec), False
    if status == InfrastructureError.exit_status and complaint:
        return Result(spec.title, Ending.FAILED, complaint, spec), False
    how = f"was killed by {signal.Signals(-status).name}" if status < 0 else f"ended with status {status}"
    more = f"; it said last: {complaint}" if complaint else ""
    return Result(spec.title, Ending.FAILED, f"its process {how} and left no finished run{more}", spec), True


def _settled(spec: RunSpec, out: Path) -> Manifest | None:
    """As `finished_run`, once what is done that a killed process had left to do. Raises DiskFullError besides."""
    directory = run_folder(out, spec)
    settle(directory)
    return finished_run(directory, spec)


def _ending_by(error: TaskSlamError) -> Ending:
    return Ending.FAILED if isinstance(error, InfrastructureError) else Ending.REFUSED


class _LastLines(Thread):
    """Reads a stream to its end beside whoever reads another, and keeps its last lines."""

    def __init__(self, stream: IO[str] | None) -> None:
        super().__init__(daemon=True)
        self._stream = stream
        self._lines: deque[str] = deque(maxlen=_LAST_LINES)
        self.start()

    def run(self) -> None:
        """Until the stream ends, or is closed."""
        with contextlib.suppress(ValueError):
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
