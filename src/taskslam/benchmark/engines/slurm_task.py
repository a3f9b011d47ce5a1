"""One task of an array job: `python -m taskslam.benchmark.engines.slurm_task FOLDER`, its number from Slurm.

Drives the run in a worker that it watches, as the local engine does, and writes down why where it could not. What this
machine is to blame for is tried again, on whichever node Slurm chooses then.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from taskslam.benchmark.campaign.notes import keep
from taskslam.benchmark.engine import Ending, Result, Watcher
from taskslam.benchmark.engines.slurm import SPECS
from taskslam.benchmark.engines.supervised import Order, Workers, drive, without_driving
from taskslam.benchmark.spec import RunSpec
from taskslam.endings import ending_of
from taskslam.errors import InputError
from taskslam.stopping import StoppedError, stop_behind, stop_on_signals

_MOST_RESTARTS = 2  # that are asked for here; those after a preemption count too
_STATUS = {Ending.INCOMPLETE: 1, Ending.REFUSED: 2, Ending.UNAVAILABLE: 2, Ending.FAILED: 3}


def main() -> int:
    """Drive the run of this task; the exit status, as the command line's."""
    stop_on_signals()
    try:
        task = _task(Path(sys.argv[1]), int(os.environ["SLURM_ARRAY_TASK_ID"]))
        spec, out = RunSpec.from_json(task["spec"]), Path(task["out"])
        folders = tuple(Path(folder) for folder in task["folders"])
        result = _driven(Order(spec, out, folders, int(task["cores"]), take_over=True))
        keep(out, result)
    except BaseException as error:
        ending = ending_of(stop_behind(error))
        sys.stderr.write(f"{ending.sentence}\n")
        return ending.status
    sys.stdout.write(f"{result.title}: {result.ending}{f': {result.detail}' if result.detail else ''}\n")
    sys.stdout.flush()
    if result.ending in {Ending.FAILED, Ending.UNAVAILABLE}:
        _again()
    return _STATUS.get(result.ending, 0)


def _driven(order: Order) -> Result:
    if (result := without_driving(order.spec, order.out)) is not None:
        return result
    workers = Workers()
    try:
        return drive(order, Watcher(), workers)
    except BaseException as error:
        workers.stop()
        if isinstance(stop := stop_behind(error), StoppedError):
            why = f"{stop} by Slurm, which may start it again: a requeue, a preemption, or its time was up"
            keep(order.out, Result(order.spec.title, Ending.FAILED, why, order.spec))
        raise


def _task(folder: Path, number: int) -> dict[str, Any]:
    with (folder / SPECS).open(encoding="utf-8") as lines:
        for count, line in enumerate(lines):
            if count == number:
                task = json.loads(line)
                assert isinstance(task, dict)
                return task
    raise InputError(f"{folder / SPECS}: has no line {number}, which task {number} is to drive")


def _again() -> None:
    """Ask Slurm to start this task anew, unless that has been done often enough."""
    if int(os.environ.get("SLURM_RESTART_COUNT", "0")) >= _MOST_RESTARTS:
        return
    task = f"{os.environ['SLURM_ARRAY_JOB_ID']}_{os.environ['SLURM_ARRAY_TASK_ID']}"
    subprocess.run(["scontrol", "requeue", task], check=False, timeout=60)  # noqa: S603, S607 the cluster's own


if __name__ == "__main__":
    sys.exit(main())
