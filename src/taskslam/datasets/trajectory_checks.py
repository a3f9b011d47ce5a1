"""Whether a trajectory that was read can be evaluated, and what of it had to be left out.

Poses that are not numbers, whose quaternion is none, or whose stamp stands out of order are left out and counted; of
two with the same stamp the second. Where more are wrong than right, or a second run follows the first, it is refused.
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
from taskslam.skipped import too_many

_LONGEST_GAP_S = 10 * 365 * 86400
_SHORTEST_STEP_NS = 1000
_ROUNDED = 1e-3  # of a quaternion's length: from here on it is said
_FEW = 0.1  # of a file, out of order: a slip; more is another run, or another clock

Rows = npt.NDArray[np.int64]


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
    rows, unit, more = _with_rotations(rows, quaternions, place)
    rows, out_of_order = _in_order(rows, stamps, place)
    notes += more + out_of_order
    again = np.diff(stamps[rows], prepend=stamps[rows[0]] - 1) == 0
    if again.any():
        first = place(int(rows[np.argmax(again)]))
        notes += (
            f"{np.count_nonzero(again)} poses have the stamp of the one before and are left out (first: {first})",
        )
        rows = rows[~again]
    _check_unit(stamps[rows], place)
    return ReadTrajectory(SpatialTrajectory(stamps[rows], positions[rows], unit[rows]), notes)


def _with_rotations(
    rows: Rows, quaternions: FloatArray, place: Callable[[int], str]
) -> tuple[Rows, FloatArray, tuple[str, ...]]:
    """The rows whose quaternion is one, all quaternions normalised, and what is to be said of it."""
    unit, bad = unit_quaternions(np.where(np.isfinite(quaternions), quaternions, 0.0))
    bad = bad[rows]
    notes: tuple[str, ...] = ()
    if bad.any():
        first = int(rows[np.argmax(bad)])
        norm = float(np.linalg.norm(quaternions[first]))
        if too_many(int(np.count_nonzero(bad)), len(rows)):
            raise TrajectoryError(f"{place(first)}: expected a unit quaternion, found one of length {norm:.6g}")
        count = np.count_nonzero(bad)
        where = f"(first: {place(first)}, of length {norm:.6g})"
        notes += (f"{count} of {len(rows)} poses have no unit quaternion and are left out {where}",)
        rows = rows[~bad]
    norms = np.linalg.norm(quaternions[rows], axis=1)
    rounded = np.abs(norms - 1.0) > _ROUNDED
    if rounded.any():
        lengths = f"{norms.min():.4f} to {norms.max():.4f}"
        count = np.count_nonzero(rounded)
        notes += (f"{count} of {len(rows)} quaternions are rounded, to lengths of {lengths}, and normalised",)
    return rows, unit, notes


def _in_order(rows: Rows, stamps: npt.NDArray[np.int64], place: Callable[[int], str]) -> tuple[Rows, tuple[str, ...]]:
    """The rows whose stamps ascend, fewest left out at each place, and what is to be said of it.

    Raises TrajectoryError for stamps of two clocks or units, and for one run that follows another.
    """
    wrong = np.zeros(len(rows), dtype=np.bool_)
    # In doubles, because the difference of two stamps in the wrong unit can leave int64.
    leaps = np.flatnonzero(np.abs(np.diff(stamps[rows].astype(np.float64))) > _LONGEST_GAP_S * NANOSECONDS)
    if len(leaps):
        clock = np.zeros(len(rows), dtype=np.int64)
        middle = np.median(stamps[rows].astype(np.float64))
        clock[np.abs(stamps[rows].astype(np.float64) - middle) > _LONGEST_GAP_S * NANOSECONDS] = 1
        wrong |= clock == 1
        if wrong.sum() > _FEW * len(rows):
            row = int(leaps[0])
            raise TrajectoryError(
                f"{place(int(rows[row + 1]))}: the stamp leaps from {seconds(int(stamps[rows[row]]))} s "
                f"to {seconds(int(stamps[rows[row + 1]]))} s; expected stamps of one clock in one unit"
            )
    late, ahead = (np.zeros(len(rows), dtype=np.bool_) for _ in range(2))
    kept = np.flatnonzero(~wrong)
    ordered = stamps[rows[kept]]
    late[kept] = ordered < np.maximum.accumulate(ordered)
    ahead[kept] = ordered > np.minimum.accumulate(ordered[::-1])[::-1]
    unordered = late if late.sum() <= ahead.sum() else ahead
    if unordered.any():
        row = int(np.argmax(late))
        before = int(kept[np.searchsorted(kept, row) - 1])
        if unordered.sum() > max(_FEW * len(rows), 1):
            raise TrajectoryError(
                f"{place(int(rows[row]))}: time goes backwards, from {seconds(int(stamps[rows[before]]))} s to "
                f"{seconds(int(stamps[rows[row]]))} s; expected ascending stamps, and one file for each run"
            )
    wrong |= unordered
    if not wrong.any():
        return rows, ()
    first = place(int(rows[np.argmax(wrong)]))
    return rows[~wrong], (
        f"{np.count_nonzero(wrong)} of {len(rows)} poses have stamps out of order and are left out (first: {first})",
    )


def _check_unit(stamps: npt.NDArray[np.int64], place: Callable[[int], str]) -> None:
    """Raise TrajectoryError for stamps that follow each other faster than any sensor's."""
    steps = np.diff(stamps)
    if len(steps) > 1 and np.median(steps) < _SHORTEST_STEP_NS:
        raise TrajectoryError(
            f"{place(0).partition(',')[0]}: poses follow each other after {np.median(steps):g} ns; "
            "are the stamps in another unit than this format's (TUM: seconds, EuRoC csv: nanoseconds)?"
        )
