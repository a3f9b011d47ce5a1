"""Trajectories out of files, told apart by their names and first lines: TUM, EuRoC csv, KITTI, and topics of bags.

run.tum, run.txt     timestamp tx ty tz qx qy qz qw      (TUM: seconds)
data.csv             timestamp, x, y, z, qw, qx, qy, qz  (EuRoC: nanoseconds)
any of these         columns in any order that a header names, and further ones (`trajectory_layout.py`)
run.npy              an array (N, 8), as TUM has it     (seconds)
00.txt               twelve numbers a line               (KITTI: rows of the 3 x 4 matrix; stamps in a times file)
drive.bag, drive.mcap, drive.db3, a rosbag2 folder; with a topic: drive.bag:/odom
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from taskslam.datasets.bag_trajectories import is_bag, read_bag_trajectory
from taskslam.datasets.trajectory_checks import ReadTrajectory, checked_trajectory
from taskslam.datasets.trajectory_layout import KITTI_COLUMNS, Head, layout_of, read_head
from taskslam.errors import RecordError, TrajectoryError
from taskslam.measurements import NANOSECONDS
from taskslam.reading import LARGEST_TABLE, is_there, read_array
from taskslam.record.number_table import NumberTable, StampUnit, read_number_table
from taskslam.record.trajectories import COLUMNS, SpatialTrajectory
from taskslam.skipped import too_many

_TUM = f"eight numbers '{' '.join(COLUMNS)}' separated by blanks"
_EUROC = "at least eight numbers 'timestamp x y z qw qx qy qz' separated by commas"
_KITTI = "twelve numbers separated by blanks, the rows of a 3 x 4 pose matrix"
_RIGID = 2e-2  # what three decimals leave of a rotation
_EXACT = 1e-3
_LATEST_S = 4e9  # of seconds in an array: the year 2096


def read_trajectory_file(
    source: str, times: Path | None = None, unit: StampUnit | None = None, truth: SpatialTrajectory | None = None
) -> ReadTrajectory:
    """Read one trajectory. times: for KITTI files, seconds of each pose, one number a line.

    unit: of its stamps; truth: the ground truth, in whose time they should lie, where the unit is to be guessed.

    Raises TrajectoryError saying what is wrong, where, and what was expected.
    """
    path, topic = split_topic(source)
    if topic is not None or is_bag(path):
        return read_bag_trajectory(path, topic)
    if path.suffix.lower() == ".npy":
        return _read_npy(path)
    try:
        head = read_head(path)
        if path.suffix.lower() not in (".tum", ".csv") and head.rows and len(head.rows[0]) == KITTI_COLUMNS:
            return _read_kitti(path, times)
        return _read_table(path, head, unit, truth)
    except RecordError as error:
        raise TrajectoryError(str(error)) from None


def split_topic(source: str) -> tuple[Path, str | None]:
    """`drive.bag:/odom` as path and topic; a path that exists as it stands has no topic."""
    parts = source.split(":")
    for at in range(1, len(parts)) if not is_there(Path(source)) else ():
        head, topic = ":".join(parts[:at]), ":".join(parts[at:])
        if head and topic and is_bag(Path(head)):
            return Path(head), topic
    return Path(source), None


def _read_table(path: Path, head: Head, unit: StampUnit | None, truth: SpatialTrajectory | None) -> ReadTrajectory:
    span = None if truth is None else (truth.stamps[0] / NANOSECONDS, truth.stamps[-1] / NANOSECONDS)
    layout = layout_of(path, head, unit, span)
    expected = _TUM if layout.separator == " " else _EUROC
    table = read_number_table(
        path,
        8,
        expected,
        layout.unit,
        separator=layout.separator,
        cut_off_allowed=True,
        layout=layout.columns or None,
        skip_bad_lines=True,
    )
    bad = table.bad[table.bad != layout.header_line]
    if too_many(len(bad), len(bad) + len(table.lines)):
        words = f" of {len(head.rows[0])} columns" if head.rows else ""
        raise TrajectoryError(f"{path}, line {bad[0]}: expected {expected}, found {table.first_bad}{words}")
    skipped = (f"{len(bad)} lines are no poses and left out (first: line {bad[0]})",) if len(bad) else ()
    notes = layout.notes + _cut_off(table) + skipped
    return checked_trajectory(table.stamps, table.values[:, :3], table.values[:, 3:], _place(path, table), notes)


def _read_npy(path: Path) -> ReadTrajectory:
    """Stamps become nanoseconds as near as a double of seconds tells them: to some 200 ns today."""
    table = read_array(path, "trajectory", TrajectoryError, LARGEST_TABLE)
    if table.ndim != 2 or table.shape[1] != len(COLUMNS) or table.dtype.kind not in "iuf":
        found = f"an array {table.shape} of {table.dtype}"
        raise TrajectoryError(f"{path}: {found}; expected (N, 8) numbers, as TUM has them")
    table = table.astype(np.float64)
    with np.errstate(invalid="ignore"):
        whole = np.isfinite(table[:, 0]) & (np.abs(table[:, 0]) < _LATEST_S)
    if not whole.all():
        row = int(np.argmin(whole))
        raise TrajectoryError(f"{path}, row {row}: expected seconds first, found {table[row, 0]:g}")
    whole_s = np.floor(table[:, 0])
    rest_ns = np.round((table[:, 0] - whole_s) * NANOSECONDS).astype(np.int64)
    stamps = whole_s.astype(np.int64) * NANOSECONDS + rest_ns
    return checked_trajectory(stamps, table[:, 1:4], table[:, 4:], lambda row: f"{path}, row {row}")


def _read_kitti(path: Path, times: Path | None) -> ReadTrajectory:
    from scipy.spatial.transform import Rotation

    if times is None:
        raise TrajectoryError(f"{path}: twelve numbers a line are KITTI poses, which have no stamps; give a times file")
    clock = read_number_table(times, 1, "one number, the seconds of a pose", "seconds")
    table = read_number_table(path, 12, _KITTI, None)
    if len(clock.stamps) != len(table.values):
        raise TrajectoryError(
            f"{path}: holds {len(table.values)} poses, {times} has {len(clock.stamps)} stamps; expected one for each"
        )
    rows = table.values.reshape(-1, 3, 4)
    place = _place(path, table)
    finite = np.isfinite(np.abs(table.values).max(axis=1, initial=0.0))
    turns = np.where(finite[:, None, None], rows[:, :, :3], np.eye(3))
    off = np.abs(turns @ turns.transpose(0, 2, 1) - np.eye(3)).reshape(-1, 9).max(axis=1, initial=0.0)
    bad = (off > _RIGID) | (np.linalg.det(turns) < 0)
    notes: tuple[str, ...] = ()
    if bad.any():
        first = place(int(np.argmax(bad)))
        if too_many(int(np.count_nonzero(bad)), len(bad)):
            raise TrajectoryError(f"{first}: expected a rotation in the first three columns of the matrix")
        notes += (f"{np.count_nonzero(bad)} matrices are no rotations and left out (first: {first})",)
    if (rounded := (off > _EXACT) & ~bad).any():
        notes += (f"{np.count_nonzero(rounded)} matrices are rounded and made rotations again",)
    turns[bad] = np.eye(3)
    quaternions = Rotation.from_matrix(turns).as_quat() if len(turns) else np.empty((0, 4))
    quaternions[~finite] = np.nan
    whole = np.flatnonzero(~bad)
    at = lambda row: place(int(whole[row])) if len(whole) else place(row)  # noqa: E731
    return checked_trajectory(clock.stamps[whole], rows[whole][:, :, 3], quaternions[whole], at, notes)


def _place(path: Path, table: NumberTable) -> Callable[[int], str]:
    return lambda row: f"{path}, line {table.lines[row]}" if len(table.lines) else str(path)


def _cut_off(table: NumberTable) -> tuple[str, ...]:
    return ("the last line was cut off and is left out",) if table.cut_off else ()
