"""From the record of a run to its metrics, over the rounds that count.

Which rounds count: all but the priming round, which is excluded exactly once, by its own mark in the journal
(protocol D0.3, 7.3 #4). M is the number of rounds planned, so a round that never began counts as missed (7.3 #17).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from taskslam.errors import RecordError
from taskslam.evaluation import curves
from taskslam.evaluation.completeness import completeness
from taskslam.evaluation.metrics_file import (
    ErrorShare,
    Failure,
    NormalizedArea,
    Orientation,
    Position,
    Repeatability,
    RoundSummary,
    RunMetrics,
    WaypointMetrics,
)
from taskslam.evaluation.quantities import measured, measured_at
from taskslam.evaluation.soundness import check_record
from taskslam.evaluation.uncertainty import Sample, uncertainty
from taskslam.evaluation.upstream import NONE, Deviation, Deviations
from taskslam.evaluation.waypoint_metrics import row_if_known, row_of, waypoint_metrics
from taskslam.measurements import NANOSECONDS
from taskslam.mode import Mode
from taskslam.record import Arrival, GoalFailed, MethodNotice, RoundEnded, RoundStarted, RunRecord


def run_metrics(record: RunRecord, name: str, deviations: Deviations = NONE) -> RunMetrics:
    """All metrics of one run; `name` says where it stands.

    deviations: those of the published code to reproduce; the metrics then carry `by_definition` too.

    Raises RecordError if the journal contradicts the manifest, or if the infrastructure failed: such a run says
    nothing about its method (design D6).
    """
    check_record(record)
    metrics = _metrics(record, name, deviations)
    found: dict[str, object] = {"quantities": measured([metrics], (), metrics.uncertainty)}
    if deviations:
        found["by_definition"] = _metrics(record, name, NONE).headline
    return metrics.model_copy(update=found)


def _metrics(record: RunRecord, name: str, deviations: Deviations) -> RunMetrics:
    manifest = record.manifest
    counted, planned_rounds = _counted_rounds(record.rounds(), manifest.rounds, deviations)
    per_waypoint, complete_truths = waypoint_metrics(record, counted, planned_rounds, deviations)
    per_waypoint = tuple(replace(waypoint, quantities=measured_at(waypoint)) for waypoint in per_waypoint)
    judged = [waypoint for waypoint in per_waypoint if waypoint.unjudged is None]
    if not judged:
        raise RecordError(f"{record.directory}: none of the waypoints can be judged: {per_waypoint[0].unjudged}")
    complete = [waypoint for waypoint in per_waypoint if waypoint.complete]
    failures = _failures(record)
    rounds = _round_summaries(record)
    sample = Sample(
        visits=complete_truths,
        goals=None if manifest.truth_frame == "waypoint" else np.array([w.target for w in complete]).reshape(-1, 3),
        complete=len(complete),
        planned=len(judged),
        rounds=planned_rounds,
        with_map=manifest.mode is Mode.WITH_MAP,
        on_failure=manifest.task.protocol.on_failure.value,
        driven=sum(summary.reached for summary in rounds) + len(failures) - _legs_lost(per_waypoint, planned_rounds),
        failed=len(failures),
    )
    return RunMetrics(
        directory=name,
        scenario=manifest.scenario_name,
        method=manifest.method,
        mode=manifest.mode.value,
        seed=manifest.seed,
        rounds=planned_rounds,
        completeness=completeness(waypoint.complete for waypoint in judged),
        complete_waypoints=len(complete),
        planned_waypoints=len(judged),
        position=Position(
            precision_m=_mean(waypoint.position.precision_m for waypoint in complete),
            accuracy_m=_mean(waypoint.position.accuracy_m for waypoint in complete),
        ),
        precision_rms_m=_mean(waypoint.precision_rms_m for waypoint in complete),
        orientation=Orientation(
            precision_rad=_mean(waypoint.orientation.precision_rad for waypoint in complete),
            accuracy_rad=_mean(waypoint.orientation.accuracy_rad for waypoint in complete),
        ),
        iso9283=Repeatability(
            pose_accuracy_m=_mean(waypoint.iso9283.pose_accuracy_m for waypoint in complete),
            pose_repeatability_m=_mean(waypoint.iso9283.pose_repeatability_m for waypoint in complete),
            pose_accuracy_rad=_mean(waypoint.iso9283.pose_accuracy_rad for waypoint in complete),
            pose_repeatability_rad=_mean(waypoint.iso9283.pose_repeatability_rad for waypoint in complete),
        ),
        n_auc=_n_auc(complete, len(judged), planned_rounds),
        uncertainty=uncertainty([sample]),
        control=_mean_share([waypoint.control for waypoint in complete]),
        estimation=_mean_share([waypoint.estimation for waypoint in complete]),
        waypoints=per_waypoint,
        failures=failures,
        failures_by_kind=dict(sorted(Counter(failure.outcome for failure in failures).items())),
        round_summaries=rounds,
        simulated_s=manifest.simulated_s,
        wall_s=manifest.wall_s,
        compute_s=manifest.compute_s,
        method_peak_bytes=manifest.method_peak_bytes,
        own_peak_bytes=manifest.own_peak_bytes,
        real_time_factor=manifest.simulated_s / manifest.wall_s if manifest.wall_s > 1e-9 else None,
        frames=sum(summary.frames for summary in rounds),
        dropped_frames=sum(summary.dropped_frames for summary in rounds),
        notices=sum(isinstance(event, MethodNotice) for event in record.events),
        journal_truncated=record.truncated,
        journal_damaged=record.damaged,
        files_changed=record.changed,
        truth_frame=manifest.truth_frame,
        method_options=manifest.method_options,
        latency=manifest.latency,
        planner=manifest.planner,
        robot=manifest.robot_name,
        behaviour=manifest.behaviour,
    )


def _counted_rounds(starts: Iterable[RoundStarted], rounds: int, deviations: Deviations) -> tuple[list[int], int]:
    """Numbers of the rounds that count, and M."""
    starts = sorted(starts, key=lambda start: start.round)
    numbers = [start.round for start in starts if not start.priming]
    primed = len(numbers) < len(starts)
    if Deviation.PRIMING_ROUND in deviations:
        return [start.round for start in starts][:rounds], rounds
    if Deviation.DOUBLE_SKIP in deviations and primed and rounds > 1:
        return numbers[1:], rounds - 1
    return numbers, rounds


def _legs_lost(found: Sequence[WaypointMetrics], rounds: int) -> int:
    """Legs of which nobody knows how they ended."""
    return sum(rounds - waypoint.rounds for waypoint in found)


def _n_auc(complete: list[WaypointMetrics], planned: int, rounds: int) -> NormalizedArea:
    """With one round there is no precision, so no curve; with several and no complete waypoint it is 0."""
    if rounds < 2:
        return NormalizedArea(published=None, published_real_grid=None, exact=None)
    return curves.normalized_area([waypoint.position.precision_m for waypoint in complete], planned)


def _failures(record: RunRecord) -> tuple[Failure, ...]:
    priming = {start.round: start.priming for start in record.rounds()}
    return tuple(
        Failure(
            round=event.round,
            priming=priming[event.round],
            goal=event.goal,
            target=row_of(event.target),
            outcome=event.outcome.value,
            blames=event.outcome.blames,
            detail=event.detail,
            t_s=event.t / NANOSECONDS,
            truth=row_if_known(event.truth),
            estimate=row_if_known(event.estimate),
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


def _mean_share(shares: list[ErrorShare]) -> ErrorShare:
    return ErrorShare(
        position_m=_mean(share.position_m for share in shares),
        heading_rad=_mean(share.heading_rad for share in shares),
        spread_m=_mean(share.spread_m for share in shares),
    )


def _mean(values: Iterable[float | None]) -> float | None:
    defined = [value for value in values if value is not None]
    return math.fsum(defined) / len(defined) if defined else None
