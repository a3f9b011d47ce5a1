"""The engine of this machine: so many worker processes at a time, one run each."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

from taskslam.benchmark.engine import Ending, Result, Watcher
from taskslam.benchmark.run import finished_run
from taskslam.benchmark.spec import RunSpec, run_folder
from taskslam.errors import InputError, MethodUnavailableError, RecordError
from taskslam.slam.cards import card_of

_ENDINGS = {0: Ending.COMPLETE, 1: Ending.INCOMPLETE, 2: Ending.REFUSED}


@dataclass(frozen=True)
class LocalEngine:
    """parallel: processes at a time. folders: where worlds and maps of the user's lie."""

    parallel: int = 1
    folders: tuple[Path, ...] = ()

    def run(self, specs: Sequence[RunSpec], out: Path, watcher: Watcher) -> Iterator[Result]:
        """As `Engine.run`."""
        heard = _OneAtATime(watcher)
        with ThreadPoolExecutor(max_workers=self.parallel) as pool:
            yield from pool.map(lambda spec: self._run(spec, out, heard), specs)

    def _run(self, spec: RunSpec, out: Path, watcher: Watcher) -> Result:
        result = _without_driving(spec, out) or self._in_process(spec, out, watcher)
        watcher.ends(result)
        return result

    def _in_process(self, spec: RunSpec, out: Path, watcher: Watcher) -> Result:
        watcher.begins(spec)
        order = {"spec": spec.to_json(), "out": str(out), "folders": [str(folder) for folder in self.folders]}
        command = [sys.executable, "-m", "taskslam.benchmark.engines.worker", str(os.getpid())]
        with subprocess.Popen(  # noqa: S603 our own interpreter and module
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process:
            assert process.stdin is not None
            assert process.stdout is not None
            assert process.stderr is not None
            process.stdin.write(json.dumps(order))
            process.stdin.close()
            last: dict[str, object] = {}
            for line in process.stdout:
                last = json.loads(line)
                watcher.goes_on(spec, last)
            complaint = process.stderr.read().strip().splitlines()
            status = process.wait()
        detail = str(last.get("notice", "")) if status == 1 else (complaint[-1] if complaint else "")
        return Result(spec.title, _ENDINGS.get(status, Ending.FAILED), detail, spec)


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
