"""metrics.json: the results of runs as numbers, versioned (docs/metrics.md). What is not defined is null.

Positions are metres in `map`, angles radians, poses [x, y, theta].
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Literal, TypeAlias

from pydantic import BaseModel, ConfigDict

from taskslam.record.files import write_whole

METRICS_FORMAT: Literal["taskslam-metrics/1"] = "taskslam-metrics/1"
METRICS_FILE = "metrics.json"

PoseRow: TypeAlias = tuple[float, float, float]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Position(_Part):
    """E and e in metres."""

    precision_m: float | None
    accuracy_m: float | None


class Orientation(_Part):
    """Delta (round to round) and delta (to the goal) in radians."""

    precision_rad: float | None
    accuracy_rad: float | None


class ErrorShare(_Part):
    """One of the two shares of an arrival error (protocol 7.3 #9); spread: its part that differs between rounds."""

    position_m: float | None
    heading_rad: float | None
    spread_m: float | None


class Visit(_Part):
    """One arrival. A pose that was not measured is null."""

    round: int
    t_s: float
    truth: PoseRow | None
    estimate: PoseRow | None
    odometry: PoseRow | None


class WaypointMetrics(_Part):
    """One waypoint, by its index in the sequence. rounds: M; visits: rounds that reached it."""

    goal: int
    target: PoseRow
    visits: int
    rounds: int
    complete: bool
    position: Position
    precision_rms_m: float | None
    orientation: Orientation
    mean_pose: PoseRow | None
    control: ErrorShare
    estimation: ErrorShare
    arrivals: tuple[Visit, ...]


class Failure(_Part):
    """A goal that was not reached: where, when and why. blames: navigation or method (design D6)."""

    round: int
    priming: bool
    goal: int
    target: PoseRow
    outcome: str
    blames: str
    detail: str
    t_s: float
    truth: PoseRow | None
    estimate: PoseRow | None


class RoundSummary(_Part):
    """One round. outcome is null if the journal ends before the round does; reached: goals reached."""

    round: int
    priming: bool
    outcome: str | None
    reached: int
    duration_s: float | None
    frames: int
    dropped_frames: int


class NormalizedArea(_Part):
    """N-AUC: on the grid published for simulation, on that for the real robot, and exactly over 120 cm."""

    published: float | None
    published_real_grid: float | None
    exact: float | None


class RunMetrics(_Part):
    """One run. position, orientation, control, estimation: means over complete waypoints, each with weight 1."""

    directory: str
    scenario: str
    method: str
    mode: str
    seed: int
    rounds: int
    completeness: float
    complete_waypoints: int
    planned_waypoints: int
    position: Position
    precision_rms_m: float | None
    orientation: Orientation
    n_auc: NormalizedArea
    control: ErrorShare
    estimation: ErrorShare
    waypoints: tuple[WaypointMetrics, ...]
    failures: tuple[Failure, ...]
    failures_by_kind: dict[str, int]
    round_summaries: tuple[RoundSummary, ...]
    simulated_s: float
    wall_s: float
    compute_s: float
    real_time_factor: float | None
    frames: int
    dropped_frames: int
    notices: int
    journal_truncated: bool

    def round_name(self, number: int) -> str:
        """`priming round`, or the round by its place among those that count: `round 1` to `round M`."""
        counted = [summary.round for summary in self.round_summaries if not summary.priming]
        return f"round {counted.index(number) + 1}" if number in counted else "priming round"


class LeftOut(_Part):
    """A folder that could not be evaluated, and why."""

    directory: str
    reason: str


class MetricsFile(_Part):
    """The content of metrics.json. definitions: `paper`, or `upstream` with the published code's deviations."""

    format: Literal["taskslam-metrics/1"] = METRICS_FORMAT
    definitions: Literal["paper", "upstream"] = "paper"
    runs: tuple[RunMetrics, ...]
    left_out: tuple[LeftOut, ...] = ()


def write_metrics(folder: Path, metrics: MetricsFile) -> Path:
    """Write metrics.json into a folder, whole or not at all; returns its path. Raises DiskFullError."""
    path = folder / METRICS_FILE
    write_whole(path, metrics.model_dump_json(indent=2) + "\n")
    return path


def pose_row(values: Iterable[float]) -> PoseRow:
    """[x, y, theta] as plain floats."""
    x, y, theta = (float(value) for value in values)
    return (x, y, theta)
