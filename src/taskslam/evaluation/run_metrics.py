"""From the record of a run to its metrics: arrivals by goal index, over the rounds that count.

Which rounds count: all but the priming round, which is excluded exactly once, by its own mark in the journal
(protocol D0.3, 7.3 #4). Arrivals are keyed by goal index, never by the order of visiting (5.9 e). M is the number of
rounds planned, so a round that never began counts as missed (7.3 #17).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict

import numpy as np

from taskslam.errors import RecordError
from taskslam.evaluation import curves, waypoints
from taskslam.evaluation.completeness import completeness, is_complete
from taskslam.evaluation.errors import PoseError, control_error, estimation_error
from taskslam.evaluation.metrics_file import (
    ErrorShare,
    Failure,
    NormalizedArea,
    Orientation,
    PoseRow,
    Position,
    RoundSummary,
    RunMetrics,
    Visit,
    WaypointMetrics,
    pose_row,
)
from taskslam.geometry import SE2, FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.record import Arrival, GoalFailed, MethodNotice, RoundEnded, RoundStarted, RunRecord


def run_metrics(record: RunRecord, name: str, upstream_compat: bool = False) -> RunMetrics:
    """All metrics of one run; `name` says where it stands.

    upstream_compat: heading formulas of the published code (5.9 a, b), and with-map rounds as it picks them: the
    priming round in, the last one out (5.9 c).

    Raises RecordError if the journal contradicts the manifest, or if the infrastructure failed: such a run says
    nothing about its method (design D6).
    """
    manifest = record.manifest
    _check(record)
    counted = _counted_rounds(record.rounds(), manifest.rounds, upstream_compat)
    arrivals = _arrivals(record, counted)
    per_waypoint = tuple(
        _waypoint(goal, target, arrivals.get(goal, ()), manifest.rounds, upstream_compat)
        for goal, target in enumerate(manifest.goals)
    )
    complete = [waypoint for waypoint in per_waypoint if waypoint.complete]
    failures = _failures(record)
    rounds = _round_summaries(record)
    return RunMetrics(
        directory=name,
        scenario=manifest.scenario_name,
        method=manifest.method,
        mode=manifest.mode,
        seed=manifest.seed,
        rounds=manifest.rounds,
        completeness=completeness(waypoint.complete for waypoint in per_waypoint),
        complete_waypoints=len(complete),
        planned_waypoints=len(per_waypoint),
        position=Position(
            precision_m=_mean(waypoint.position.precision_m for waypoint in complete),
            accuracy_m=_mean(waypoint.position.accuracy_m for waypoint in complete),
        ),
        precision_rms_m=_mean(waypoint.precision_rms_m for waypoint in complete),
        orientation=Orientation(
            precision_rad=_mean(waypoint.orientation.precision_rad for waypoint in complete),
            accuracy_rad=_mean(waypoint.orientation.accuracy_rad for waypoint in complete),
        ),
        n_auc=_n_auc(complete, len(per_waypoint), manifest.rounds),
        control=_mean_share([waypoint.control for waypoint in complete]),
        estimation=_mean_share([waypoint.estimation for waypoint in complete]),
        waypoints=per_waypoint,
        failures=failures,
        failures_by_kind=dict(sorted(Counter(failure.outcome for failure in failures).items())),
        round_summaries=rounds,
        simulated_s=manifest.simulated_s,
        wall_s=manifest.wall_s,
        compute_s=manifest.compute_s,
        real_time_factor=manifest.simulated_s / manifest.wall_s if manifest.wall_s > 0 else None,
        frames=sum(summary.frames for summary in rounds),
        dropped_frames=sum(summary.dropped_frames for summary in rounds),
        notices=sum(isinstance(event, MethodNotice) for event in record.events),
        journal_truncated=record.truncated,
    )


def _check(record: RunRecord) -> None:
    """Raise RecordError where the journal cannot belong to this manifest."""
    manifest, where = record.manifest, record.directory
    if manifest.source == "replay":
        raise RecordError(
            f"{where}: an open-loop replay has no goals: `taskslam evaluate-trajectories` judges it per frame"
        )
    numbers = [start.round for start in record.rounds()]
    if len(set(numbers)) != len(numbers):
        raise RecordError(f"{where}: the journal starts a round twice; expected every round number once")
    planned = sum(not start.priming for start in record.rounds())
    if planned > manifest.rounds:
        raise RecordError(f"{where}: the journal has {planned} rounds, run.json says {manifest.rounds}")
    seen = set()
    for event in record.events:
        if isinstance(event, Arrival | GoalFailed):
            if event.goal >= len(manifest.goals):
                raise RecordError(f"{where}: goal {event.goal} in the journal; the sequence has {len(manifest.goals)}")
            if event.round not in numbers:
                raise RecordError(f"{where}: goal {event.goal} ended in round {event.round}, which never began")
        if isinstance(event, Arrival):
            if (event.round, event.goal) in seen:
                raise RecordError(f"{where}: two arrivals at goal {event.goal} in round {event.round}; expected one")
            seen.add((event.round, event.goal))
        if isinstance(event, GoalFailed | RoundEnded) and event.outcome.blames == "infrastructure":
            raise RecordError(f"{where}: ended by {event.outcome}, which says nothing about the method: run it again")


def _counted_rounds(starts: Iterable[RoundStarted], rounds: int, upstream_compat: bool) -> set[int]:
    if upstream_compat:
        return set(sorted(start.round for start in starts)[:rounds])
    return {start.round for start in starts if not start.priming}


def _arrivals(record: RunRecord, counted: set[int]) -> Mapping[int, list[Arrival]]:
    by_goal: dict[int, list[Arrival]] = {}
    for event in record.events:
        if isinstance(event, Arrival) and event.round in counted:
            by_goal.setdefault(event.goal, []).append(event)
    return by_goal


def _waypoint(
    goal: int, target: SE2, arrivals: Iterable[Arrival], rounds: int, upstream_compat: bool
) -> WaypointMetrics:
    arrivals = sorted(arrivals, key=lambda arrival: arrival.round)
    truths = _rows(arrival.truth for arrival in arrivals)
    estimates = _rows(arrival.estimate for arrival in arrivals)
    both = [arrival for arrival in arrivals if arrival.truth is not None and arrival.estimate is not None]
    at = target.array()
    return WaypointMetrics(
        goal=goal,
        target=pose_row(at),
        visits=len(arrivals),
        rounds=rounds,
        complete=is_complete(len(arrivals), rounds),
        position=Position(
            precision_m=_defined(waypoints.position_precision(truths)),
            accuracy_m=_defined(waypoints.position_accuracy(truths, at)),
        ),
        precision_rms_m=_defined(waypoints.position_precision_rms(truths)),
        orientation=Orientation(
            precision_rad=_defined(waypoints.orientation_precision(truths, upstream_compat)),
            accuracy_rad=_defined(waypoints.orientation_accuracy(truths, at, upstream_compat)),
        ),
        mean_pose=pose_row(waypoints.mean_pose(truths)) if len(truths) else None,
        control=_share(control_error(estimates, at)),
        estimation=_share(
            estimation_error(_rows(arrival.estimate for arrival in both), _rows(arrival.truth for arrival in both))
        ),
        arrivals=tuple(
            Visit(
                round=arrival.round,
                t_s=arrival.t / NANOSECONDS,
                truth=_row(arrival.truth),
                estimate=_row(arrival.estimate),
                odometry=_row(arrival.odometry),
            )
            for arrival in arrivals
        ),
    )


def _n_auc(complete: list[WaypointMetrics], planned: int, rounds: int) -> NormalizedArea:
    """With one round there is no precision, so no curve; with several and no complete waypoint it is 0."""
    if rounds < 2:
        return NormalizedArea(published=None, published_real_grid=None, exact=None)
    values = [w.position.precision_m for w in complete if w.position.precision_m is not None]
    return NormalizedArea(
        published=curves.n_auc_on_grid(values, planned, curves.SIMULATION_GRID),
        published_real_grid=curves.n_auc_on_grid(values, planned, curves.REAL_GRID),
        exact=curves.n_auc_exact(values, planned),
    )


def _failures(record: RunRecord) -> tuple[Failure, ...]:
    priming = {start.round: start.priming for start in record.rounds()}
    return tuple(
        Failure(
            round=event.round,
            priming=priming[event.round],
            goal=event.goal,
            target=pose_row(event.target.array()),
            outcome=event.outcome.value,
            blames=event.outcome.blames,
            detail=event.detail,
            t_s=event.t / NANOSECONDS,
            truth=_row(event.truth),
            estimate=_row(event.estimate),
        )
        for event in record.events
        if isinstance(event, GoalFailed)
    )


def _round_summaries(record: RunRecord) -> tuple[RoundSummary, ...]:
    ends = {event.round: event for event in record.events if isinstance(event, RoundEnded)}
    reached = Counter(event.round for event in record.events if isinstance(event, Arrival))
    summaries = []
    for start in record.rounds():
        end = ends.get(start.round)
        summaries.append(
            RoundSummary(
                round=start.round,
                priming=start.priming,
                outcome=end.outcome.value if end else None,
                reached=reached[start.round],
                duration_s=(end.t - start.t) / NANOSECONDS if end else None,
                frames=end.frames if end else 0,
                dropped_frames=end.dropped_frames if end else 0,
            )
        )
    return tuple(summaries)


def _rows(poses: Iterable[SE2 | None]) -> FloatArray:
    """(V, 3) of the poses that are known."""
    return np.array([pose.array() for pose in poses if pose is not None], dtype=np.float64).reshape(-1, 3)


def _row(pose: SE2 | None) -> PoseRow | None:
    return None if pose is None else (float(pose.x), float(pose.y), float(pose.theta))


def _defined(value: float) -> float | None:
    return None if math.isnan(value) else value


def _share(error: PoseError) -> ErrorShare:
    return ErrorShare(**{name: _defined(value) for name, value in asdict(error).items()})


def _mean_share(shares: list[ErrorShare]) -> ErrorShare:
    return ErrorShare(
        position_m=_mean(share.position_m for share in shares),
        heading_rad=_mean(share.heading_rad for share in shares),
        spread_m=_mean(share.spread_m for share in shares),
    )


def _mean(values: Iterable[float | None]) -> float | None:
    defined = [value for value in values if value is not None]
    return math.fsum(defined) / len(defined) if defined else None
