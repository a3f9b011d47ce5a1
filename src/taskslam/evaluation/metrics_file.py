"""metrics.json: the results of runs as numbers, versioned (docs/metrics.md). What is not defined is null.

Positions are metres in `map`, angles radians, poses [x, y, theta]. What a run holds by the dozen is a plain dataclass:
a tenth of a pydantic model's memory, and its numbers were checked when the journal was read.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import indent
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from taskslam.errors import RecordError
from taskslam.files import write_whole
from taskslam.reading import LARGEST_METRICS, LARGEST_NUMBER, read_bytes
from taskslam.user_files import complaint

METRICS_FORMAT: Literal["taskslam-metrics/4"] = "taskslam-metrics/4"
METRICS_FILE = "metrics.json"

Real: TypeAlias = Annotated[float, Field(ge=-LARGEST_NUMBER, le=LARGEST_NUMBER)]
PoseRow: TypeAlias = tuple[Real, Real, Real]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Position:
    """E and e in metres."""

    precision_m: Real | None
    accuracy_m: Real | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Orientation:
    """Delta (round to round) and delta (to the goal) in radians."""

    precision_rad: Real | None
    accuracy_rad: Real | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorShare:
    """One of the two shares of an arrival error (protocol 7.3 #9); spread: its part that differs between rounds."""

    position_m: Real | None
    heading_rad: Real | None
    spread_m: Real | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeatability:
    """Pose accuracy AP and pose repeatability RP of ISO 9283, position and heading."""

    pose_accuracy_m: Real | None = None
    pose_repeatability_m: Real | None = None
    pose_accuracy_rad: Real | None = None
    pose_repeatability_rad: Real | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """A quantity with the ends of its 95 % interval, in SI units."""

    value: Real | None
    low: Real | None = None
    high: Real | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Visit:
    """One arrival. A pose that was not measured is null."""

    round: int
    t_s: Real
    truth: PoseRow | None
    estimate: PoseRow | None
    odometry: PoseRow | None


@dataclass(frozen=True, slots=True, kw_only=True)
class WaypointMetrics:
    """One waypoint, by its index in the sequence.

    rounds: M, less those in which the measurement lost it; visits: rounds of these that reached it. Of fewer than M
    rounds, E, its RMS and Delta are brought to M (docs/metrics.md).

    unjudged: why it leaves all denominators, such as that no camera watched it; null where it counts. quantities: by
    key, those that have a value here (`quantities/`).
    """

    goal: int
    target: PoseRow
    visits: int
    rounds: int
    complete: bool
    position: Position
    precision_rms_m: Real | None
    orientation: Orientation
    iso9283: Repeatability = Repeatability()
    mean_pose: PoseRow | None
    control: ErrorShare
    estimation: ErrorShare
    arrivals: tuple[Visit, ...]
    unjudged: str | None = None
    quantities: dict[str, Real] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """A goal that was not reached: where, when and why. blames: navigation or method (design D6)."""

    round: int
    priming: bool
    goal: int
    target: PoseRow
    outcome: str
    blames: str
    detail: str
    t_s: Real
    truth: PoseRow | None
    estimate: PoseRow | None


@dataclass(frozen=True, slots=True, kw_only=True)
class RoundSummary:
    """One round. outcome is null if the journal ends before the round does; reached: goals reached."""

    round: int
    priming: bool
    outcome: str | None
    reached: int
    duration_s: Real | None
    frames: int
    dropped_frames: int


class NormalizedArea(_Part):
    """N-AUC: on the grid published for simulation, on that for the real robot, and exactly over 120 cm."""

    published: Real | None
    published_real_grid: Real | None
    exact: Real | None


class Interval(_Part):
    """A confidence interval, in the unit of what it belongs to."""

    low: Real
    high: Real


class Legs(_Part):
    """Drives from one goal to the next, the priming round's too. failure_chance: that of one leg (docs/metrics.md).

    on_failure: what a failed goal does, `abort` or `skip`.
    """

    driven: int
    failed: int
    on_failure: str
    failure_chance: Interval


class Uncertainty(_Part):
    """How sure the means are: intervals at `level`, null where the rounds are too few (below 3; e, delta: below 2).

    seeds: that the intervals are over. With one, read rounds below; with several, seeds, in which the rounds are
    contained (then E needs 2 rounds, and e one). precision_m, accuracy_m, precision_rad, accuracy_rad, n_auc_exact:
    over rounds and waypoints, for other rounds at other such waypoints. precision_here_m: over rounds alone, for other
    rounds at these very waypoints. completeness: of other such runs, from the failures per leg. precision_unbiased_m:
    E divided by sqrt(1 - 1/M), an estimate of E of endlessly many rounds; the ends of an interval may be divided
    likewise. rounds_to_halve, seeds_to_halve: rounds of one seed, or seeds, that would halve precision_here_m; null
    where the other one says that, or below three.
    """

    level: Real
    precision_m: Interval | None
    precision_here_m: Interval | None
    accuracy_m: Interval | None
    precision_rad: Interval | None
    accuracy_rad: Interval | None
    completeness: Interval
    n_auc_exact: Interval | None
    precision_unbiased_m: Real | None
    legs: Legs
    rounds_to_halve: int | None
    seeds: int = 1
    seeds_to_halve: int | None = None


class Headline(_Part):
    """The numbers of a run that are published, in metres, radians and shares."""

    completeness: Real
    precision_m: Real | None
    accuracy_m: Real | None
    precision_rad: Real | None
    accuracy_rad: Real | None
    n_auc: Real | None


class RunMetrics(_Part):
    """One run. position, orientation, iso9283, control, estimation: means over complete waypoints, each with weight 1.

    planned_waypoints: those that can be judged. truth_frame: `waypoint` where true poses have no place in `map`: then
    accuracy and the share of estimation are not defined. method_options, latency, planner (the local one) and robot say
    in which way the method was run; null where it is not known.
    journal_damaged: a sentence with file and line for every line of the journal that could not be used.
    files_changed: a sentence for every file that is not what it was when the run was finished.
    quantities: every quantity of the list by its key. behaviour: the version of what drove, null where it is not known.
    by_definition: where the numbers are those of the published code, what the paper's definitions give; else null.
    """

    directory: str
    scenario: str
    method: str
    mode: str
    seed: int
    rounds: int
    completeness: Real
    complete_waypoints: int
    planned_waypoints: int
    position: Position
    precision_rms_m: Real | None
    orientation: Orientation
    iso9283: Repeatability
    n_auc: NormalizedArea
    uncertainty: Uncertainty
    control: ErrorShare
    estimation: ErrorShare
    waypoints: tuple[WaypointMetrics, ...]
    failures: tuple[Failure, ...]
    failures_by_kind: dict[str, int]
    round_summaries: tuple[RoundSummary, ...]
    simulated_s: Real
    wall_s: Real
    compute_s: Real
    method_peak_bytes: int | None = None
    own_peak_bytes: int | None = None
    real_time_factor: Real | None
    frames: int
    dropped_frames: int
    notices: int
    journal_truncated: bool
    journal_damaged: tuple[str, ...] = ()
    files_changed: tuple[str, ...] = ()
    truth_frame: Literal["map", "waypoint"] = "map"
    method_options: dict[str, Any] = Field(default_factory=dict)
    latency: str | None = None
    planner: str | None = None
    robot: str | None = None
    by_definition: Headline | None = None
    behaviour: int | None = None
    quantities: dict[str, Measured] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _waypoints_by_their_index(self) -> RunMetrics:
        if [waypoint.goal for waypoint in self.waypoints] != list(range(len(self.waypoints))):
            raise ValueError("waypoints: expected those of goal 0, 1 and so on in this order")
        return self

    @property
    def seeds(self) -> tuple[int, ...]:
        """Its one seed, as a row of several has them."""
        return (self.seed,)

    @property
    def headline(self) -> Headline:
        """The published numbers among these."""
        return Headline(
            completeness=self.completeness,
            precision_m=self.position.precision_m,
            accuracy_m=self.position.accuracy_m,
            precision_rad=self.orientation.precision_rad,
            accuracy_rad=self.orientation.accuracy_rad,
            n_auc=self.n_auc.published,
        )

    def round_name(self, number: int) -> str:
        """`priming round`, or the round by its place among those that count: `round 1` to `round M`."""
        counted = [summary.round for summary in self.round_summaries if not summary.priming]
        return f"round {counted.index(number) + 1}" if number in counted else "priming round"


class Row(_Part):
    """A method in one mode at one scenario, over all its seeds: what a table shows. With one seed as that run.

    method: its name with the way in which it was run, where it was run in several. seeds, directories: of its runs, in
    their order; missing: seeds that another method drove in this mode and this one did not, whose waypoints count as
    missed. Means are over the complete waypoints of all seeds, each with weight 1. What a run took is summed.
    """

    scenario: str
    method: str
    mode: str
    seeds: tuple[int, ...]
    directories: tuple[str, ...]
    missing: int
    rounds: tuple[int, ...]
    complete_waypoints: int
    planned_waypoints: int
    completeness: Real
    position: Position
    orientation: Orientation
    n_auc: NormalizedArea
    uncertainty: Uncertainty
    quantities: dict[str, Measured]
    failures_by_kind: dict[str, int]
    simulated_s: Real
    wall_s: Real
    compute_s: Real
    real_time_factor: Real | None
    frames: int
    dropped_frames: int
    method_peak_bytes: int | None


class Comparison(_Part):
    """Two methods in one mode, on the waypoints that both completed (docs/metrics.md).

    metric: `precision` (E) or `accuracy` (e). a_mean_m, b_mean_m: means over the common waypoints; a_only, b_only:
    waypoints that only one completed. ratio: geometric mean over the common ones of a's value over b's, each E freed
    of the bias of few rounds; below 1 where a is better; with its interval over rounds. p: of the t test on its
    logarithm; p_adjusted: after Holm's correction over the pairs of a mode. p_permutation: of exchanging rounds
    between the two, or whole runs where there are many; it cannot be below p_permutation_floor. cliffs_delta: -1 where
    every value of a is below every one of b, to 1. better_at: common waypoints at which a's value is smaller.
    told_apart: whether the data tell the two apart; verdict: that in a sentence. rounds_needed: rounds of each that
    would tell a difference of this size with a power of 80 %, null if more than 1000. seeds: that the waypoints come
    from. over_seeds: whether interval and tests are over seeds and not over rounds; then seeds_needed stands for
    rounds_needed, p_permutation is of swapping whole runs, and nothing is told apart below six seeds.
    """

    metric: str
    mode: str
    a: str
    b: str
    waypoints: int
    a_only: int
    b_only: int
    rounds: tuple[int, int]
    a_mean_m: Real | None
    b_mean_m: Real | None
    ratio: Real | None
    ratio_interval: Interval | None
    p: Real | None
    p_adjusted: Real | None
    p_permutation: Real | None
    p_permutation_floor: Real | None
    cliffs_delta: Real | None
    better_at: int
    told_apart: bool
    rounds_needed: int | None
    verdict: str
    seeds: int = 1
    over_seeds: bool = False
    seeds_needed: int | None = None


class LeftOut(_Part):
    """A folder that could not be evaluated, and why."""

    directory: str
    reason: str


class MetricsFile(_Part):
    """The content of metrics.json. definitions: `paper`, or `upstream` with the deviations of the published code.

    rows: every method in every mode at every scenario, over its seeds. comparisons: every pair of methods in a mode,
    for precision and for accuracy.
    """

    format: Literal["taskslam-metrics/2", "taskslam-metrics/3", "taskslam-metrics/4"] = METRICS_FORMAT
    definitions: Literal["paper", "upstream"] = "paper"
    deviations: tuple[str, ...] = ()
    runs: tuple[RunMetrics, ...]
    rows: tuple[Row, ...] = ()
    comparisons: tuple[Comparison, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


def write_metrics(folder: Path, metrics: MetricsFile) -> Path:
    """Write metrics.json into a folder, whole or not at all; returns its path. Raises DiskFullError."""
    path = folder / METRICS_FILE
    write_whole(path, _pieces(metrics))
    return path


def _pieces(metrics: MetricsFile) -> Iterator[str]:
    """The same text as `model_dump_json(indent=2)`, a run at a time: of ten thousand it would be half a gigabyte."""
    frame = metrics.model_copy(update={"runs": ()}).model_dump_json(indent=2)
    before, empty, after = frame.partition('"runs": []')  # not within a string: there its quotes are escaped
    yield before + ('"runs": [' if metrics.runs else empty)
    for index, run in enumerate(metrics.runs):
        yield ("," if index else "") + "\n" + indent(run.model_dump_json(indent=2), "    ")
    yield ("\n  ]" if metrics.runs else "") + after + "\n"


def read_metrics(path: Path) -> MetricsFile:
    """Read a metrics.json. Raises RecordError naming the file and what was expected."""
    data = read_bytes(path, "metrics", RecordError, LARGEST_METRICS)
    try:
        return MetricsFile.model_validate_json(data)
    except ValidationError as error:
        raise RecordError(f"{path}: expected {METRICS_FORMAT!r}: {complaint(error, MetricsFile)}") from None
