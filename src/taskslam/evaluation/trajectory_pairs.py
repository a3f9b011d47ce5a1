"""Pairs of poses for relative errors: so many frames, metres, degrees or seconds apart, chosen as evo chooses them.

Consecutive pairs (the default) follow one another, each beginning where the last one ended. All pairs begin at every
pose: finer, but neighbouring pairs share most of their way, so their errors are far from independent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.errors import TrajectoryError
from taskslam.evaluation.trajectory_rotations import rotation_angles
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.record.trajectories import SpatialTrajectory

# Of the wanted distance: how far an "all pairs" pair may miss it. evo's default.
TOLERANCE = 0.1


class DeltaUnit(StrEnum):
    """In what the two poses of a pair are apart."""

    FRAMES = "frames"
    METRES = "m"
    DEGREES = "deg"
    SECONDS = "s"


@dataclass(frozen=True)
class Pairs:
    """(P,) row of the first and of the second pose of each pair."""

    first: npt.NDArray[np.int64]
    second: npt.NDArray[np.int64]


def pairs(
    trajectory: SpatialTrajectory, delta: float, unit: DeltaUnit, all_pairs: bool = False, tolerance: float = TOLERANCE
) -> Pairs:
    """Pairs of poses of a trajectory that are `delta` apart; evo takes the estimate for it.

    Frames: rows, a whole number. Metres: along the way. Degrees: turned in all on the way. Seconds: elapsed. A
    consecutive pair ends where `delta` is reached or passed. With all_pairs, the second pose is the one whose distance
    from the first is nearest to `delta`, if it misses it by no more than `tolerance` of it. All pairs by degrees are
    not offered: evo compares every pose with every other one there, a number that grows with the square.

    Raises TrajectoryError: delta is not positive or not whole where it must be, or there is no such pair.
    """
    if not (math.isfinite(delta) and delta > 0) or (unit is DeltaUnit.FRAMES and delta != int(delta)):
        raise TrajectoryError(f"RPE over {delta:g} {unit}: expected a positive {'whole ' * (unit == 'frames')}number")
    count = len(trajectory)
    if unit is DeltaUnit.FRAMES:
        start = np.arange(0, max(count - int(delta), 0), 1 if all_pairs else int(delta), dtype=np.int64)
        found = Pairs(start, start + int(delta))
    elif not all_pairs:
        wanted = math.radians(delta) if unit is DeltaUnit.DEGREES else delta
        ends = np.empty(count, dtype=np.int64)
        ends = ends[: _reached(_steps(trajectory, unit), wanted, ends)]
        found = Pairs(np.concatenate([np.zeros(min(len(ends), 1), dtype=np.int64), ends[:-1]]), ends)
    elif unit is DeltaUnit.DEGREES:
        raise TrajectoryError("RPE over degrees: all pairs are not offered; expected consecutive pairs")
    else:
        way = np.concatenate([[0.0], np.cumsum(_steps(trajectory, unit))])
        found = _all_pairs(way, delta, tolerance * delta)
    if not len(found.first):
        raise TrajectoryError(f"RPE over {delta:g} {unit}: none of the {count} poses are that far apart")
    return found


def _steps(trajectory: SpatialTrajectory, unit: DeltaUnit) -> FloatArray:
    """(N - 1,) from pose to pose: metres, radians or seconds."""
    if unit is DeltaUnit.SECONDS:
        return np.diff(trajectory.stamps) / NANOSECONDS
    if unit is DeltaUnit.METRES:
        lengths: FloatArray = np.linalg.norm(np.diff(trajectory.positions, axis=0), axis=1)
        return lengths
    return rotation_angles(trajectory.quaternions[:-1], trajectory.quaternions[1:])


@njit(cache=True)
def _reached(steps: FloatArray, delta: float, ends: npt.NDArray[Any]) -> int:
    """Rows at which `delta` is reached since the last such row; returns how many."""
    count, way = 0, 0.0
    for row in range(len(steps)):
        way += steps[row]
        if way >= delta:
            ends[count] = row + 1
            count += 1
            way = 0.0
    return count


def _all_pairs(way: FloatArray, delta: float, tolerance: float) -> Pairs:
    """For each row the later one whose way is nearest to `delta` from it, the earliest of equals."""
    first = np.arange(len(way) - 1)
    at = np.searchsorted(way, way[:-1] + delta)
    after = np.clip(at, first + 1, len(way) - 1)
    before = np.clip(at - 1, first + 1, len(way) - 1)
    # A robot that stood still has many rows of the same way: the earliest counts.
    before = np.maximum(np.searchsorted(way, way[before]), first + 1)
    misses = [np.abs(way[rows] - way[:-1] - delta) for rows in (before, after)]
    second = np.where(misses[0] <= misses[1], before, after)
    near = np.minimum(*misses) <= tolerance
    return Pairs(first[near], second[near])
