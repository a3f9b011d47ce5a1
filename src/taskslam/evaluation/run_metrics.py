"""From the record of a run to its metrics: arrivals by goal index, over the rounds that count.

Which rounds count: all but the priming round, which is excluded exactly once, by its own mark in the journal
(protocol D0.3, 7.3 #4). Arrivals are keyed by goal index, never by the order of visiting (5.9 e). M is the number of
rounds planned, so a round that never began counts as missed (7.3 #17). An arrival whose pose the measurement of a real
robot lost, or a damaged journal, is missing data (`missing.py`): its waypoint is judged on the rounds that are left, if
they are two.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from taskslam.errors import RecordError
from taskslam.evaluation import curves, waypoints
from taskslam.evaluation.completeness import completeness, is_complete
from taskslam.evaluation.errors import PoseError, control_error, estimation_error
from taskslam.evaluation.intervals import precision_bias
from taskslam.evaluation.iso9283 import iso9283
from taskslam.evaluation.metrics_file import (
    ErrorShare,
    Failure,
    NormalizedArea,
    Orientation,
    PoseRow,
    Position,
    Repeatability,
    RoundSummary,
    RunMetrics,
    Visit,
    WaypointMetrics,
)
from taskslam.evaluation.missing import FEWEST
from taskslam.evaluation.uncertainty import Sample, uncertainty
from taskslam.evaluation.upstream import NONE, Deviation, Deviations
from taskslam.geometry import SE2, FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.record import Arrival, GoalFailed, MethodNotice, RoundEnded, RoundStarted, RunRecord

FARTHEST = 1e7
"""Metres. What lies farther away than the pole from the equator is no place, and its square is soon no number."""


def run_metrics(record: RunRecord, name: str, deviations: Deviations = NONE) -> RunMetrics:
    """All metrics of one run; `name` says where it stands.

    deviations: those of the published code to reproduce; the metrics then carry `by_definition` too.

    Raises RecordError if the journal contradicts the manifest, or if the infrastructure failed: such a run says
    nothing about its method (design D6).
    """
    _check(record)
    metrics = _metrics(record, name, deviations)
    if not deviations:
        return metrics
    return metrics.model_copy(update={"by_definition": _metrics(record, name, NONE).headline})


def _metrics(record: RunRecord, name: str, deviations: Deviations) -> RunMetrics:
    manifest = record.manifest
    counted, planned_rounds = _counted_rounds(record.rounds(), manifest.rounds, deviations)
    per_waypoint, complete_truths = _waypoints(
        record, _arrivals(record, counted, deviations), counted, planned_rounds, deviations
    )
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
        with_map=manifest.mode == "with-map",
        on_failure=_on_failure(manifest.scenario),
        driven=sum(summary.reached for summary in rounds) + len(failures) - _legs_lost(per_waypoint, planned_rounds),
        failed=len(failures),
    )
    return RunMetrics(
        directory=name,
        scenario=manifest.scenario_name,
        method=manifest.method,
        mode=manifest.mode,
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
        real_time_factor=manifest.simulated_s / manifest.wall_s if manifest.wall_s > 0 else None,
        frames=sum(summary.frames for summary in rounds),
        dropped_frames=sum(summary.dropped_frames for summary in rounds),
        notices=sum(isinstance(event, MethodNotice) for event in record.events),
        journal_truncated=record.truncated,
        journal_damaged=record.damaged,
        truth_frame=manifest.truth_frame,
        method_options=manifest.method_options,
        latency=manifest.latency,
        planner=manifest.planner,
        robot=manifest.robot_name,
    )


def _check(record: RunRecord) -> None:
    """Raise RecordError where the journal cannot belong to this manifest."""
    manifest, where, goals = record.manifest, record.directory, len(record.manifest.goals)
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
            if event.goal >= goals:
                raise RecordError(f"{where}: goal {event.goal} in the journal; the sequence has {goals}")
            if event.round not in numbers:
                raise RecordError(f"{where}: goal {event.goal} ended in round {event.round}, which never began")
        if isinstance(event, Arrival):
            for pose in (event.target, event.truth, event.estimate):
                if pose is not None and max(abs(pose.x), abs(pose.y)) > FARTHEST:
                    raise RecordError(
                        f"{where}: goal {event.goal} in round {event.round}: a pose at ({pose.x:g}, {pose.y:g}) m; "
                        f"expected one within {FARTHEST:g} m"
                    )
            if (event.round, event.goal) in seen:
                raise RecordError(f"{where}: two arrivals at goal {event.goal} in round {event.round}; expected one")
            seen.add((event.round, event.goal))
        if isinstance(event, GoalFailed | RoundEnded) and event.outcome.blames == "infrastructure":
            raise RecordError(f"{where}: ended by {event.outcome}, which says nothing about the method: run it again")


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


def _arrivals(record: RunRecord, counted: Sequence[int], deviations: Deviations) -> Mapping[tuple[int, int], Arrival]:
    """Arrivals by goal and round."""
    wanted = set(counted)
    arrivals = [event for event in record.events if isinstance(event, Arrival) and event.round in wanted]
    if Deviation.VISITING_ORDER not in deviations:
        return {(arrival.goal, arrival.round): arrival for arrival in arrivals}
    place: Counter[int] = Counter()
    by_order = {}
    for arrival in arrivals:
        by_order[place[arrival.round], arrival.round] = arrival
        place[arrival.round] += 1
    return by_order


def _waypoints(
    record: RunRecord,
    arrivals: Mapping[tuple[int, int], Arrival],
    counted: Sequence[int],
    rounds: int,
    deviations: Deviations,
) -> tuple[tuple[WaypointMetrics, ...], FloatArray | None]:
    """Metrics of every waypoint, and (M, N, 3) true poses at the complete ones.

    NaN where the measurement lost one; None if one is not known for another reason.
    """
    manifest = record.manifest
    table = [[arrivals.get((goal, number)) for number in counted] for goal in range(len(manifest.goals))]
    lost = [_lost(record, row) if goal not in manifest.unjudged else 0 for goal, row in enumerate(table)]
    truths, estimates = _poses(table, "truth"), _poses(table, "estimate")
    targets = np.array([(target.x, target.y, target.theta) for target in manifest.goals])
    # Poses in frames of their own say nothing about a goal or an estimate in `map`.
    unknown = manifest.truth_frame == "waypoint"
    goals, in_map = (np.full_like(poses, np.nan) if unknown else poses for poses in (targets, truths))
    brought = np.array([_to_planned_rounds(rounds, rounds - count) for count in lost])
    columns = {
        "E": waypoints.position_precision(truths) * brought,
        "e": waypoints.position_accuracy(truths, goals),
        "rms": waypoints.position_precision_rms(truths) * brought,
        "Delta": waypoints.orientation_precision(truths, deviations) * brought,
        "delta": waypoints.orientation_accuracy(truths, goals, deviations),
    }
    iso = iso9283(truths, goals)
    numbers = {name: _defined(values) for name, values in columns.items()}
    repeatability = [
        Repeatability(pose_accuracy_m=a, pose_repeatability_m=b, pose_accuracy_rad=c, pose_repeatability_rad=d)
        for a, b, c, d in zip(
            _defined(iso.pose_accuracy_m),
            _defined(iso.pose_repeatability_m),
            _defined(iso.pose_accuracy_rad),
            _defined(iso.pose_repeatability_rad),
            strict=True,
        )
    ]
    means = waypoints.mean_pose(truths).tolist()
    control, estimation = _shares(control_error(estimates, targets)), _shares(estimation_error(estimates, in_map))
    found = []
    for goal, row in enumerate(table):
        visits = tuple(_visit(arrival) for arrival in row if arrival is not None)
        measured, of = len(visits) - lost[goal], rounds - lost[goal]
        unjudged = manifest.unjudged.get(goal)
        if lost[goal] and measured == of and measured < FEWEST:
            unjudged = f"{measured} of {rounds} rounds known, {FEWEST} needed"
        found.append(
            WaypointMetrics(
                goal=goal,
                target=tuple(targets[goal].tolist()),
                visits=measured,
                rounds=of,
                complete=is_complete(measured, of) and unjudged is None,
                position=Position(precision_m=numbers["E"][goal], accuracy_m=numbers["e"][goal]),
                precision_rms_m=numbers["rms"][goal],
                orientation=Orientation(precision_rad=numbers["Delta"][goal], accuracy_rad=numbers["delta"][goal]),
                iso9283=repeatability[goal],
                mean_pose=None if math.isnan(means[goal][0]) else tuple(means[goal]),
                control=control[goal],
                estimation=estimation[goal],
                arrivals=visits,
                unjudged=unjudged,
            )
        )
    complete = [waypoint.complete for waypoint in found]
    unknown_poses = np.isnan(truths[complete, :, 0]).sum(axis=1)
    whole = unknown_poses.tolist() == [count for count, done in zip(lost, complete, strict=True) if done]
    return tuple(found), truths[complete].transpose(1, 0, 2) if whole else None


def _lost(record: RunRecord, row: Sequence[Arrival | None]) -> int:
    """Arrivals of one waypoint that are missing data: no image decides, or the journal is damaged.

    Not those of a run without any truth, which was not measured.
    """
    arrivals = [arrival for arrival in row if arrival is not None and arrival.truth is None]
    if record.manifest.source == "measured":
        return len(arrivals)
    return sum((arrival.round, arrival.goal) in record.lost for arrival in arrivals)


def _to_planned_rounds(planned: int, left: int) -> float:
    """By what a scatter about the mean of `left` rounds is multiplied to compare with that of M: both fall short."""
    return precision_bias(planned) / precision_bias(left) if 2 <= left < planned else 1.0


def _legs_lost(found: Sequence[WaypointMetrics], rounds: int) -> int:
    """Legs of which nobody knows how they ended."""
    return sum(rounds - waypoint.rounds for waypoint in found)


def _on_failure(scenario: Mapping[str, Any]) -> str:
    """What a failed goal does: `abort` unless the scenario says `skip`."""
    protocol = scenario.get("protocol")
    return "skip" if isinstance(protocol, Mapping) and protocol.get("on_failure") == "skip" else "abort"


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
            target=_target(event.target),
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


def _poses(table: Sequence[Sequence[Arrival | None]], name: str) -> FloatArray:
    """(N, M, 3) of one kind of pose at every goal in every round; NaN where there was no arrival or no such pose."""
    missing = (math.nan, math.nan, math.nan)
    rows = [[_row(getattr(arrival, name)) or missing if arrival else missing for arrival in row] for row in table]
    return np.array(rows, dtype=np.float64).reshape(len(table), -1, 3)


def _visit(arrival: Arrival) -> Visit:
    return Visit(
        round=arrival.round,
        t_s=arrival.t / NANOSECONDS,
        truth=_row(arrival.truth),
        estimate=_row(arrival.estimate),
        odometry=_row(arrival.odometry),
    )


def _row(pose: SE2 | None) -> PoseRow | None:
    return None if pose is None else _target(pose)


def _target(pose: SE2) -> PoseRow:
    return (float(pose.x), float(pose.y), float(pose.theta))


def _defined(values: FloatArray) -> list[float | None]:
    return [None if math.isnan(value) else value for value in values.tolist()]


def _shares(error: PoseError) -> list[ErrorShare]:
    columns = (_defined(values) for values in (error.position_m, error.heading_rad, error.spread_m))
    return [ErrorShare(position_m=p, heading_rad=h, spread_m=s) for p, h, s in zip(*columns, strict=True)]


def _mean_share(shares: list[ErrorShare]) -> ErrorShare:
    return ErrorShare(
        position_m=_mean(share.position_m for share in shares),
        heading_rad=_mean(share.heading_rad for share in shares),
        spread_m=_mean(share.spread_m for share in shares),
    )


def _mean(values: Iterable[float | None]) -> float | None:
    defined = [value for value in values if value is not None]
    return math.fsum(defined) / len(defined) if defined else None
