"""One run in a process of its own: `python -m taskslam.benchmark.engines.worker PARENT`, the order on stdin as JSON.

The order: `spec`, the run as `RunSpec.to_json` says it; `out`; `folders`, where worlds and maps lie.

Prints progress as JSON lines. Exit status as the command line's: 0 complete, 1 not all goals reached, 2 refused,
3 infrastructure.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

from taskslam.benchmark.run import run
from taskslam.benchmark.spec import RunSpec
from taskslam.benchmark.stage import stage_of
from taskslam.errors import TaskSlamError
from taskslam.measurements import NANOSECONDS
from taskslam.observer import Observer
from taskslam.processes.confine import die_with_parent

_EVERY = 1.0  # s of wall time between two lines of progress


class _Reporter(Observer):
    """Writes a line a second, and every notice."""

    def __init__(self) -> None:
        self._said = time.perf_counter()
        self._goal = (0, 1)
        self._round = (0, 1)

    def round_begins(self, number: int, total: int, priming: bool) -> None:  # noqa: ARG002 the observer's signature
        self._round = (number, total)

    def heading_for(self, goal: int, goals: int) -> None:
        self._goal = (goal, goals)

    def ticked(self, now: int) -> None:
        wall = time.perf_counter()
        if wall - self._said < _EVERY:
            return
        self._said = wall
        done = (self._round[0] + self._goal[0] / self._goal[1]) / self._round[1]
        _say({"done": round(done, 3), "simulated_s": now // NANOSECONDS})

    def notice(self, text: str) -> None:
        _say({"notice": text})


def _say(line: dict[str, object]) -> None:
    sys.stdout.write(json.dumps(line) + "\n")
    sys.stdout.flush()


def main() -> int:
    """Drive the run that stands on stdin; the exit status."""
    die_with_parent(int(sys.argv[1]))
    order = json.load(sys.stdin)
    observer = _Reporter()
    try:
        spec = RunSpec.from_json(order["spec"])
        stage = stage_of(spec, [Path(folder) for folder in order["folders"]], observer)
        _, complete = run(stage, spec, Path(order["out"]), observer)
    except TaskSlamError as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_status if error.exit_status != 1 else 3
    return 0 if complete else 1


if __name__ == "__main__":
    sys.exit(main())
