"""How long a run takes to begin, the second time in a world: until the loop's first beat, in seconds of the wall clock.

    python benchmarks/start.py [--methods ground_truth karto orb_slam3 ...] [--turns 3]

Every start is a process of its own, after one that filled the caches. Two times of each: from the beginning of the
process (Python's own start, imports, world and floor plan included), and from the call of the run.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from common import machine_line, small_house

METHODS = ("karto", "rko_lio", "real_time_factor:Seeing", "msckf", "orb_slam3")


class _BegunError(Exception):
    """The first beat has come."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--methods", nargs="+", default=METHODS)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--one", metavar="METHOD", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        begin(asked.one)
        return
    print(machine_line())
    for method in asked.methods:
        seconds = [begun(method) for _ in range(asked.turns + 1)][1:]
        process, call = (statistics.median(column) for column in zip(*seconds, strict=True))
        print(f"  {method:23} {process:5.2f} s from the process's beginning, {call:5.2f} s from the call", flush=True)


def begun(method: str) -> tuple[float, float]:
    """The two times of a start in a fresh process."""
    before = time.monotonic()
    done = subprocess.run(
        [sys.executable, __file__, "--one", method], stdout=subprocess.PIPE, check=True, text=True, timeout=600
    )
    called, first = (float(word) for word in done.stdout.split()[-2:])
    return first - before, first - called


def begin(method: str) -> None:
    """Start a run up to its first beat, and print when it was called and when the beat came (monotonic, s)."""
    from taskslam.benchmark.run import run
    from taskslam.mode import Mode
    from taskslam.observer import Observer

    class Watch(Observer):
        """Ends the run at its first beat."""

        def ticked(self, now: int) -> None:  # noqa: ARG002
            raise _BegunError

    _, stage = small_house(goals=1, rounds=1)
    called = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        try:
            run(stage, stage.spec(method, Mode.WITHOUT_MAP), Path(folder), Watch())
        except _BegunError:
            print(called, time.monotonic())


if __name__ == "__main__":
    main()
