"""Many inputs for one reader, in processes that may hang or die; what is found is kept in files."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from fuzz.readers import READERS
from fuzz.worker import Inputs

LONGEST = 10.0  # s for an input
_START = 120.0  # s to import, compile and read the example


@dataclass
class Found:
    """What came of it. counts: by `read`, `refused`, `fault`; faults: number of the input and words."""

    counts: Counter[str] = field(default_factory=Counter)
    faults: list[tuple[int, str]] = field(default_factory=list)
    slowest: float = 0.0

    @property
    def inputs(self) -> int:
        return sum(self.counts.values())


def fuzz(name: str, seed: int, first: int, count: int, until: float | None = None) -> Found:
    """Feed `count` inputs to a reader, from number `first` on, or as many as can be until a moment (monotonic)."""
    found, at, end = Found(), first, first + count
    while at < end and (until is None or time.monotonic() < until):
        at = _one_process(name, seed, at, end, until, found)
    return found


def _one_process(name: str, seed: int, first: int, end: int, until: float | None, found: Found) -> int:
    """Feed until the end or until the process hangs or dies; the number of the next input."""
    command = [sys.executable, "-m", "fuzz.worker", name, str(seed), str(first), str(end - first)]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment) as process:
        try:
            answers = _Answers(process.stdout.fileno())
            if (ready := answers.next(_START)) != "ready":
                raise RuntimeError(f"{name}: the reader does not read its own example ({ready})")
            for at in range(first, end):
                begin = time.monotonic()
                if until is not None and begin >= until:
                    return end
                line = answers.next(LONGEST)
                found.slowest = max(found.slowest, time.monotonic() - begin)
                kind, words = line.split(" ", 2)[1:] if line else ("fault", "")
                if not line:
                    words = "hangs" if process.poll() is None else f"crashes with status {process.wait()}"
                found.counts[kind] += 1
                if kind == "fault":
                    found.faults.append((at, words))
                if not line:
                    return at + 1
            return end
        finally:
            process.kill()


class _Answers:
    """Lines of a pipe with patience."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor, self._rest = descriptor, b""

    def next(self, patience: float) -> str:
        """The next line; empty if none comes in time or ever."""
        end = time.monotonic() + patience
        while b"\n" not in self._rest:
            ready, _, _ = select.select([self._descriptor], [], [], max(0.0, end - time.monotonic()))
            data = os.read(self._descriptor, 1 << 16) if ready else b""
            if not data:
                return ""
            self._rest += data
        line, _, self._rest = self._rest.partition(b"\n")
        return line.decode()


def keep(name: str, seed: int, number: int, folder: Path) -> Path:
    """Write the damaged file of an input into a folder."""
    with tempfile.TemporaryDirectory() as place:
        inputs = Inputs(READERS[name], seed, Path(place) / "example")
        with inputs.damaged(number) as file:
            kept = folder / f"{name}-{seed}-{number}-{Path(file).name}"
            folder.mkdir(parents=True, exist_ok=True)
            kept.write_bytes((inputs.folder / file).read_bytes())
    return kept
