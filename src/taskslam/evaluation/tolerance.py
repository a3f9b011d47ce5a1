"""Joint tolerance: how often would a follow-up task of a given tolerance succeed at the waypoint?

A task that was taught where the robot stands on average (a gripper, a charging plug) succeeds if the robot stands
within x metres and y radians of that pose. So success(x, y) is the share of planned arrivals, N waypoints times M
rounds, within both of their waypoint's mean pose. An arrival that was missed is a failure, and so is the only arrival
at a waypoint: it has no mean but itself. One that the measurement lost is neither: it is not among the planned ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.evaluation.metrics_file import RunMetrics
from taskslam.geometry import FloatArray, wrap


@dataclass(frozen=True)
class ArrivalSpread:
    """Of each arrival that has a mean to be compared with: (A,) metres and (A,) radians.

    planned: N M over all runs, less what the measurement lost.
    """

    distances: FloatArray
    angles: FloatArray
    planned: int


def arrival_spread(runs: Sequence[RunMetrics], missing: int = 0) -> ArrivalSpread:
    """How far all arrivals of these runs lie from their means, at incomplete waypoints too.

    missing: planned arrivals of sequences without a run. An arrival whose true pose was not measured counts as missed.
    """
    rows = []
    for run in runs:
        for waypoint in run.waypoints:
            truths = [visit.truth for visit in waypoint.arrivals if visit.truth is not None]
            if len(truths) > 1 and waypoint.mean_pose is not None and waypoint.unjudged is None:
                rows.append(np.array(truths) - waypoint.mean_pose)
    table = np.concatenate(rows) if rows else np.empty((0, 3))
    planned = sum(w.rounds for run in runs for w in run.waypoints if w.unjudged is None) + missing
    return ArrivalSpread(np.hypot(table[:, 0], table[:, 1]), np.abs(wrap(table[:, 2])), planned)


def success(spread: ArrivalSpread, distances: npt.ArrayLike, angle: float = math.inf) -> FloatArray:
    """(G,) share of planned arrivals, 0 to 1, within each of (G,) metres and within `angle` radians of their mean.

    Raises ValueError if nothing was planned.
    """
    if spread.planned < 1:
        raise ValueError("no arrival was planned; expected at least one")
    within = np.sort(spread.distances[spread.angles <= angle])
    return np.asarray(np.searchsorted(within, np.asarray(distances, dtype=np.float64), "right") / spread.planned)
