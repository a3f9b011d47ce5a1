"""One run in a process of its own: `python -m taskslam.benchmark.engines.worker PARENT`, the order on stdin as JSON.

The order: `spec`, the run as `RunSpec.to_json` says it; `out`; `folders`, where worlds and maps lie; `salt` and
`take_over` as of `benchmark.run.run`.

Says progress as JSON lines, on what was its standard output: what libraries print goes to standard error. The last line
of a run that could not be driven is a `complaint`. Exit status as the command line's (`taskslam.endings`): 0 complete,
1 not all goals reached, 2 refused, 3 infrastructure, 128 + n stopped by signal n, with the rounds that ended kept.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any, TextIO

from taskslam.benchmark.one_processor import check_processor
from taskslam.benchmark.run import run
from taskslam.benchmark.spec import RunSpec
from taskslam.benchmark.stage import stage_of
from taskslam.endings import ending_of
from taskslam.measurements import NANOSECONDS
from taskslam.observer import Observer
from taskslam.processes.confine import die_with_parent
from taskslam.stopping import stop_on_signals

_EVERY = 1.0  # s of wall time between two lines of progress


class _Reporter(Observer):
    """Writes a line a second, and every notice."""

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._said = time.perf_counter()
        self._goal = (0, 1)
        self._round = (0, 1)

    def say(self, **line: object) -> None:
        """Write a line."""
        self._out.write(json.dumps(line) + "\n")
        self._out.flush()

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
        self.say(done=round(done, 3), simulated_s=now // NANOSECONDS)

    def notice(self, text: str) -> None:
        self.say(notice=text)


def main() -> int:
    """Drive the run that stands on stdin; the exit status."""
    die_with_parent(int(sys.argv[1]))
    stop_on_signals()
    observer = _Reporter(_own_output())
    try:
        return _drive(json.load(sys.stdin), observer)
    except BaseException as error:
        ending = ending_of(error)
        observer.say(complaint=ending.sentence)
        return ending.status


def _drive(order: dict[str, Any], observer: _Reporter) -> int:
    spec = RunSpec.from_json(order["spec"])
    stage = stage_of(spec, [Path(folder) for folder in order["folders"]], observer)
    out, salt, take_over = Path(order["out"]), order["salt"], bool(order["take_over"])
    check_processor(spec, out)
    _, complete = run(stage, spec, out, observer, salt=salt, take_over=take_over)
    return 0 if complete else 1


def _own_output() -> TextIO:
    """Standard output for ourselves alone; whoever else writes there writes to standard error."""
    own = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    return own


if __name__ == "__main__":
    sys.exit(main())
