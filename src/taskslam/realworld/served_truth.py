"""The true poses of a robot that was our served simulator, in place of cameras: `taskslam measure served`.

A tour that was driven on it, by whatever stack, knows no truth; the served robot's record does. The two meet by the
robot's clock.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS
from taskslam.realworld.arrivals import log_of_run
from taskslam.realworld.measured_run import write_run
from taskslam.record import Arrival, Event, GoalFailed
from taskslam.record.served import load_served
from taskslam.record.trajectories import Trajectory

_NEAR = NANOSECONDS // 5  # between an event and the true pose that is taken for it


def measure_served(directory: Path, served: Path, out: Path, overwrite: bool = False) -> Path:
    """Write the run again below `out`, with true poses; the new run directory.

    directory: a run on a robot. served: the folder of the robot's record. Raises InputError: the record does not hold
    the time of an arrival; RecordError: one of the two cannot be read, or the run stands there already.
    """
    log = log_of_run(directory)
    assert log.record is not None
    content, truth = load_served(served)

    def with_truth(event: Event) -> Event:
        match event:
            case Arrival() | GoalFailed():
                return replace(event, truth=_pose_at(truth, log.zero + event.t, served))
        return event

    events = [with_truth(event) for event in log.record.events]
    manifest = log.record.manifest
    place = out / manifest.scenario_name / log.method / log.mode / f"seed{manifest.seed}"
    said = {"served.json": (content.model_dump_json(indent=2) + "\n").encode()}
    return write_run(place, log, events, {}, "map", None, manifest.seed, said, overwrite)


def _pose_at(truth: Trajectory, stamp: int, served: Path) -> SE2:
    """The true pose nearest to an instant of the robot's clock."""
    if not len(truth):
        raise InputError(f"{served}: holds no true pose")
    nearest = int(np.abs(truth.stamps - stamp).argmin())
    off = int(truth.stamps[nearest]) - stamp
    if abs(off) > _NEAR:
        raise InputError(
            f"{served}: no true pose at {stamp / NANOSECONDS:.2f} s by the robot's clock, the nearest is"
            f" {off / NANOSECONDS:+.1f} s off: was the tour driven on this robot?"
        )
    return SE2(*truth.poses[nearest].tolist())
