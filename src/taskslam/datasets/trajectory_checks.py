"""Whether a trajectory that was read can be evaluated, and what of it had to be left out.

Poses that are not numbers, and second poses with the same stamp, are left out with a note. Whatever puts the whole in
doubt is an error: time that goes backwards, stamps in mixed units, quaternions that are none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.errors import TrajectoryError
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.reading import LARGEST_NUMBER
from taskslam.record.trajectories import SpatialTrajectory, seconds, unit_quaternions

_LONGEST_GAP_S = 10 * 365 * 86400
_SHORTEST_STEP_NS = 1000


@dataclass(frozen=True)
class ReadTrajectory:
    """A trajectory with stamps that ascend strictly, and in `notes`, a sentence each, what was left out of it."""

    trajectory: SpatialTrajectory
    notes: tuple[str, ...] = ()


def checked_trajectory(
    stamps: npt.NDArray[np.int64],
    positions: FloatArray,
    quaternions: FloatArray,
    place: Callable[[int], str],
    notes: tuple[str, ...] = (),
) -> ReadTrajectory:
    """The trajectory of (N,) stamps in ns, (N, 3) positions and (N, 4) quaternions x y z w, as it can be evaluated.

    place: says where row n stands, such as `run.tum, line 7`.

    Raises TrajectoryError naming the place.
    """
    rows = np.arange(len(stamps))
    finite = (np.abs(positions) <= LARGEST_NUMBER).all(axis=1) & np.isfinite(quaternions).all(axis=1)
    if not finite.all():
        first = place(int(np.argmin(finite)))
        notes += (f"{np.count_nonzero(~finite)} of {len(rows)} poses are not finite and left out (first: {first})",)
        rows = rows[finite]
    if not len(rows):
        raise TrajectoryError(f"{place(0).partition(',')[0]}: holds no pose; expected at least one")
    _check_time(stamps[rows], lambda row: place(int(rows[row])))
    again = np.diff(stamps[rows], prepend=stamps[rows[0]] - 1) == 0
    if again.any():
        first = place(int(rows[np.argmax(again)]))
        notes += (
            f"{np.count_nonzero(again)} poses have the stamp of the one before and are left out (first: {first})",
        )
        rows = rows[~again]
    unit, bad = unit_quaternions(quaternions[rows])
    if bad.any():
        row = int(rows[np.argmax(bad)])
        norm = float(np.linalg.norm(quaternions[row]))
        raise TrajectoryError(f"{place(row)}: expected a unit quaternion, found one of length {norm:.6g}")
    return ReadTrajectory(SpatialTrajectory(stamps[rows], positions[rows], unit), notes)


def _check_time(stamps: npt.NDArray[np.int64], place: Callable[[int], str]) -> None:
    """Raise TrajectoryError for stamps in mixed units, in the wrong unit, or going backwards."""
    steps = np.diff(stamps)
    # In doubles, because the difference of two stamps in the wrong unit can leave int64.
    leaps = np.abs(np.diff(stamps.astype(np.float64))) > _LONGEST_GAP_S * NANOSECONDS
    if leaps.any():
        row = int(np.argmax(leaps))
        raise TrajectoryError(
            f"{place(row + 1)}: the stamp leaps from {seconds(int(stamps[row]))} s "
            f"to {seconds(int(stamps[row + 1]))} s; "
            "expected stamps of one clock in one unit"
        )
    if len(steps) > 1 and 0 <= np.median(steps) < _SHORTEST_STEP_NS:
        raise TrajectoryError(
            f"{place(0).partition(',')[0]}: poses follow each other after {np.median(steps):g} ns; "
            "are the stamps in another unit than this format's (TUM: seconds, EuRoC csv: nanoseconds)?"
        )
    if (steps < 0).any():
        row = int(np.argmax(steps < 0))
        raise TrajectoryError(
            f"{place(row + 1)}: time goes backwards, from {seconds(int(stamps[row]))} s to "
            f"{seconds(int(stamps[row + 1]))} s; expected ascending stamps, and one file for each run"
        )
