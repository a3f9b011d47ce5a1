"""What a run leaves behind: events, journal, run directory, trajectories."""

from taskslam.record.events import (
    Arrival,
    Event,
    GoalFailed,
    GoalSkipped,
    GoalStarted,
    MethodNotice,
    RoundEnded,
    RoundStarted,
    RunEnded,
)
from taskslam.record.manifest import DrivenBy, Manifest
from taskslam.record.run_directory import (
    PoseName,
    RunRecord,
    RunWriter,
    find_partial_runs,
    find_runs,
    load_manifest,
    load_run,
)
from taskslam.record.trajectories import Trajectory

__all__ = [
    "Arrival",
    "DrivenBy",
    "Event",
    "GoalFailed",
    "GoalSkipped",
    "GoalStarted",
    "Manifest",
    "MethodNotice",
    "PoseName",
    "RoundEnded",
    "RoundStarted",
    "RunEnded",
    "RunRecord",
    "RunWriter",
    "Trajectory",
    "find_partial_runs",
    "find_runs",
    "load_manifest",
    "load_run",
]
