"""Time of a run against that of the ground truth: a constant offset between two clocks, and gaps without a pose."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.errors import TrajectoryError
from taskslam.evaluation.trajectory_alignment import Alignment, align
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.record.trajectories import SpatialTrajectory

FARTHEST_S = 10.0
"""Offsets are looked for so far to both sides, and no farther than a quarter of the run."""
GAP_STEPS, GAP_S = 5.0, 1.0
"""Without a pose for so many times the usual (median) step, and for so many seconds, a run has a gap."""
_MOST_POSES = 300  # of a run, spread over it: enough to see an offset
_INSIDE = 0.7  # of them, that must lie in the time of the ground truth


@dataclass(frozen=True)
class TimeOffset:
    """seconds: to add to the stamps of the run; rmse: ATE (m) as they stand, and rmse_shifted: with it added."""

    seconds: float
    rmse: float
    rmse_shifted: float


@dataclass(frozen=True)
class Gaps:
    """Of a run, as GAP_STEPS and GAP_S have it. seconds: all together."""

    count: int
    seconds: float
    longest_s: float


def find_time_offset(
    reference: SpatialTrajectory, estimate: SpatialTrajectory, kind: Alignment, start_s: float = 0.0
) -> TimeOffset | None:
    """The constant offset of the estimate's clock near `start_s` that gives the smallest ATE after alignment.

    The ground truth is interpolated at the shifted stamps. On a grid first, then by golden section. None where there
    are too few poses, or the alignment is open.
    """
    rows = np.unique(np.linspace(0, len(estimate) - 1, min(len(estimate), _MOST_POSES)).round().astype(np.int64))
    some = estimate[rows]
    zero = reference.stamps[0]
    own = (reference.stamps - zero) / NANOSECONDS
    at = (some.stamps - zero) / NANOSECONDS
    reach = min(FARTHEST_S, (at[-1] - at[0]) / 4)
    if len(rows) < 10 or reach <= 0 or len(own) < 2:
        return None

    def rmse(offset: float) -> float:
        return _rmse_at(own, reference.positions, at + offset, some, kind)

    grid = start_s + np.linspace(-reach, reach, 161)
    found = [rmse(offset) for offset in grid]
    best = int(np.argmin(found))
    if not math.isfinite(found[best]):
        return None
    step = grid[1] - grid[0]
    seconds, smallest = _golden_section(rmse, grid[best] - step, grid[best] + step)
    return TimeOffset(seconds, rmse(0.0), smallest)


def _rmse_at(
    own: FloatArray, positions: FloatArray, at: FloatArray, estimate: SpatialTrajectory, kind: Alignment
) -> float:
    inside = (at >= own[0]) & (at <= own[-1])
    if np.count_nonzero(inside) < max(_INSIDE * len(at), 3):
        return math.inf
    truth = np.column_stack([np.interp(at[inside], own, axis) for axis in positions.T])
    chosen = estimate[inside]
    reference = SpatialTrajectory(chosen.stamps, truth, chosen.quaternions)
    try:
        similarity = align(chosen, reference, kind)
    except TrajectoryError:
        return math.inf
    moved = similarity.scale * chosen.positions @ similarity.rotation.T + similarity.translation
    return float(np.sqrt(np.mean(np.sum((moved - truth) ** 2, axis=1))))


def _golden_section(function: Callable[[float], float], low: float, high: float) -> tuple[float, float]:
    """Where a function of one number is smallest between two bounds, to a tenth of a millisecond, and its value."""
    ratio = (math.sqrt(5) - 1) / 2
    inner = [high - ratio * (high - low), low + ratio * (high - low)]
    values = [function(at) for at in inner]
    while high - low > 1e-4:
        if values[0] < values[1]:
            high = inner[1]
            inner = [high - ratio * (high - low), inner[0]]
            values = [function(inner[0]), values[0]]
        else:
            low = inner[0]
            inner = [inner[1], low + ratio * (high - low)]
            values = [values[1], function(inner[1])]
    return (low + high) / 2, min(values)


def gaps_of(stamps: npt.NDArray[np.int64]) -> Gaps:
    """Where a run says nothing: its method was lost, or its file is not whole. stamps: (N,) ascending, ns."""
    wide = np.diff(stamps)[gap_steps(stamps)] / NANOSECONDS
    return Gaps(len(wide), float(wide.sum()), float(wide.max(initial=0.0)))


def gap_steps(stamps: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """(N - 1,) whether a step from stamp to stamp (ns, ascending) is a gap."""
    steps = np.diff(stamps) / NANOSECONDS
    return np.asarray(steps > max(GAP_STEPS * float(np.median(steps)), GAP_S) if len(steps) else np.empty(0, np.bool_))
