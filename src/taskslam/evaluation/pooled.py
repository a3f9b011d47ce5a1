"""One method over several sequences: its waypoints pooled, each with weight 1 (eq. (3) of the paper; protocol 5.3).

A sequence is a scenario driven with a seed. A sequence that other methods drove in the same mode and this one did not
keeps its waypoints in every denominator: leaving a run out must never make a method look better (protocol 5.9 f).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from taskslam.evaluation import curves
from taskslam.evaluation.completeness import completeness
from taskslam.evaluation.metrics_file import (
    NormalizedArea,
    Orientation,
    Position,
    RunMetrics,
    Uncertainty,
    WaypointMetrics,
)
from taskslam.evaluation.uncertainty import sample_of, uncertainty
from taskslam.evaluation.upstream import NONE, Deviation, Deviations

SequenceKey: TypeAlias = tuple[str, str, int]


@dataclass(frozen=True, slots=True)
class Pooled:
    """One method in one mode over all sequences.

    seeds: sorted. missing_runs: sequences without a run; their waypoints are in planned_waypoints. precisions_m,
    accuracies_m: E and e of each complete waypoint, where defined, in the order of the runs. position, orientation:
    their means, and uncertainty how sure these are, over all seeds, rounds and waypoints together.
    """

    runs: int
    seeds: tuple[int, ...]
    missing_runs: int
    complete_waypoints: int
    planned_waypoints: int
    completeness: float
    precisions_m: tuple[float, ...]
    accuracies_m: tuple[float, ...]
    position: Position
    orientation: Orientation
    area: NormalizedArea
    uncertainty: Uncertainty
    failures_by_kind: dict[str, int]
    frames: int
    dropped_frames: int
    compute_s: float
    real_time_factor: float | None

    @property
    def planned_runs(self) -> int:
        """Runs that exist and runs that are missing."""
        return self.runs + self.missing_runs


def sequence_key(run: RunMetrics) -> SequenceKey:
    """Mode, scenario and seed: what a run of another method must share to be a run of the same sequence."""
    return (run.mode, run.scenario, run.seed)


def missing_sequences(
    runs: Iterable[RunMetrics], everything: Iterable[RunMetrics], deviations: Deviations = NONE
) -> list[int]:
    """Planned waypoints of each sequence that `everything` holds in the modes of `runs`, and `runs` does not.

    runs: of one method; everything: of all methods. Sorted by mode, scenario and seed. Where runs of a scenario differ
    in their number of waypoints, the largest counts. deviations: the published code misses nothing (5.9 f).
    """
    if Deviation.MISSING_SEQUENCE in deviations:
        return []
    runs = list(runs)
    driven = {sequence_key(run) for run in runs}
    modes = {run.mode for run in runs}
    planned: dict[SequenceKey, int] = {}
    for run in everything:
        if run.mode in modes and sequence_key(run) not in driven:
            planned[sequence_key(run)] = max(planned.get(sequence_key(run), 0), run.planned_waypoints)
    return [planned[key] for key in sorted(planned)]


def pooled_completeness(runs: Sequence[RunMetrics], missing: Sequence[int] = ()) -> float:
    """Complete waypoints over planned waypoints of all sequences together, 0 to 1: eq. (3), not a mean of shares.

    missing: planned waypoints of each sequence that has no run. Raises ValueError for no waypoint at all.
    """
    driven = [waypoint.complete for run in runs for waypoint in run.waypoints if waypoint.unjudged is None]
    return completeness([*driven, *[False] * sum(missing)])


def pooled_precisions(runs: Sequence[RunMetrics]) -> tuple[float, ...]:
    """Precision E in metres of each complete waypoint of all sequences, in the order of the runs, where defined."""
    return _defined(waypoint.position.precision_m for waypoint in _complete(runs))


def pooled_accuracies(runs: Sequence[RunMetrics]) -> tuple[float, ...]:
    """Accuracy e in metres of each complete waypoint of all sequences, in the order of the runs, where defined."""
    return _defined(waypoint.position.accuracy_m for waypoint in _complete(runs))


def pooled_area(runs: Sequence[RunMetrics], missing: Sequence[int] = ()) -> NormalizedArea:
    """N-AUC of the pooled curve: all planned waypoints of all sequences in its denominator (protocol 5.4).

    Null if a run has one round only: it has no precision, and counting its waypoints as missed would be wrong.
    missing: as in `pooled_completeness`.
    """
    if any(run.rounds < 2 for run in runs):
        return NormalizedArea(published=None, published_real_grid=None, exact=None)
    return curves.normalized_area([w.position.precision_m for w in _complete(runs)], _planned(runs, missing))


def pool(runs: Sequence[RunMetrics], missing: Sequence[int] = ()) -> Pooled:
    """All pooled metrics of the runs of one method in one mode. Raises ValueError if there is no run."""
    if not runs:
        raise ValueError("nothing to pool: expected at least one run")
    complete = _complete(runs)
    precisions, accuracies = pooled_precisions(runs), pooled_accuracies(runs)
    wall = math.fsum(run.wall_s for run in runs)
    failures: Counter[str] = Counter()
    for run in runs:
        failures.update(run.failures_by_kind)
    return Pooled(
        runs=len(runs),
        seeds=tuple(sorted({run.seed for run in runs})),
        missing_runs=len(missing),
        complete_waypoints=len(complete),
        planned_waypoints=_planned(runs, missing),
        completeness=pooled_completeness(runs, missing),
        precisions_m=precisions,
        accuracies_m=accuracies,
        position=Position(precision_m=_mean(precisions), accuracy_m=_mean(accuracies)),
        orientation=Orientation(
            precision_rad=_mean(_defined(waypoint.orientation.precision_rad for waypoint in complete)),
            accuracy_rad=_mean(_defined(waypoint.orientation.accuracy_rad for waypoint in complete)),
        ),
        area=pooled_area(runs, missing),
        uncertainty=uncertainty([sample_of(run) for run in runs], sum(missing))
        if len(runs) > 1 or missing
        else runs[0].uncertainty,
        failures_by_kind=dict(sorted(failures.items())),
        frames=sum(run.frames for run in runs),
        dropped_frames=sum(run.dropped_frames for run in runs),
        compute_s=math.fsum(run.compute_s for run in runs),
        real_time_factor=math.fsum(run.simulated_s for run in runs) / wall if wall > 0 else None,
    )


def _complete(runs: Sequence[RunMetrics]) -> list[WaypointMetrics]:
    return [waypoint for run in runs for waypoint in run.waypoints if waypoint.complete]


def _planned(runs: Sequence[RunMetrics], missing: Sequence[int]) -> int:
    return sum(run.planned_waypoints for run in runs) + sum(missing)


def _defined(values: Iterable[float | None]) -> tuple[float, ...]:
    return tuple(value for value in values if value is not None)


def _mean(values: Sequence[float]) -> float | None:
    return math.fsum(values) / len(values) if values else None
