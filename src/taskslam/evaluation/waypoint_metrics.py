"""The metrics of every waypoint of a run, from the arrivals in its record.

Arrivals are keyed by goal index, never by the order of visiting (protocol 5.9 e). An arrival whose pose the measurement
of a real robot lost, or a damaged journal, is missing data (`missing.py`): its waypoint is judged on the rounds that
are left, if they are two.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from taskslam.evaluation import waypoints
from taskslam.evaluation.completeness import is_complete
from taskslam.evaluation.error_shares import PoseError, control_error, estimation_error
from taskslam.evaluation.intervals import precision_bias
from taskslam.evaluation.iso9283 import iso9283
from taskslam.evaluation.metrics_file import (
    ErrorShare,
    Orientation,
    PoseRow,
    Position,
    Repeatability,
    Visit,
    WaypointMetrics,
)
from taskslam.evaluation.missing import FEWEST
from taskslam.evaluation.upstream import Deviation, Deviations
from taskslam.geometry import SE2, FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.record import Arrival, RunRecord


def waypoint_metrics(
    record: RunRecord, counted: Sequence[int], rounds: int, deviations: Deviations
) -> tuple[tuple[WaypointMetrics, ...], FloatArray | None]:
    """Metrics of every waypoint, and (M, N, 3) true poses at the complete ones.

    NaN where the measurement lost one; None if one is not known for another reason.
    """
    manifest = record.manifest
    arrivals = _arrivals(record, counted, deviations)
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


def _poses(table: Sequence[Sequence[Arrival | None]], name: str) -> FloatArray:
    """(N, M, 3) of one kind of pose at every goal in every round; NaN where there was no arrival or no such pose."""
    missing = (math.nan, math.nan, math.nan)
    rows = [
        [row_if_known(getattr(arrival, name)) or missing if arrival else missing for arrival in row] for row in table
    ]
    return np.array(rows, dtype=np.float64).reshape(len(table), -1, 3)


def _visit(arrival: Arrival) -> Visit:
    return Visit(
        round=arrival.round,
        t_s=arrival.t / NANOSECONDS,
        truth=row_if_known(arrival.truth),
        estimate=row_if_known(arrival.estimate),
        odometry=row_if_known(arrival.odometry),
    )


def row_if_known(pose: SE2 | None) -> PoseRow | None:
    """As `row_of`; None of None."""
    return None if pose is None else row_of(pose)


def row_of(pose: SE2) -> PoseRow:
    """(x, y, theta) in m and rad."""
    return (float(pose.x), float(pose.y), float(pose.theta))


def _defined(values: FloatArray) -> list[float | None]:
    return [None if math.isnan(value) else value for value in values.tolist()]


def _shares(error: PoseError) -> list[ErrorShare]:
    columns = (_defined(values) for values in (error.position_m, error.heading_rad, error.spread_m))
    return [ErrorShare(position_m=p, heading_rad=h, spread_m=s) for p, h, s in zip(*columns, strict=True)]
