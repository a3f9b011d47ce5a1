"""Trajectories out of files, told apart by their names: TUM, EuRoC csv, KITTI, and the topics of bags.

run.tum, run.txt     timestamp tx ty tz qx qy qz qw      (TUM: seconds)
data.csv             timestamp, x, y, z, qw, qx, qy, qz  (EuRoC: nanoseconds; further columns are left out)
00.txt               twelve numbers a line               (KITTI: rows of the 3 x 4 matrix; stamps in a times file)
drive.bag, drive.mcap, drive.db3, a rosbag2 folder; with a topic: drive.bag:/odom
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from taskslam.datasets.bag_trajectories import is_bag, read_bag_trajectory
from taskslam.datasets.trajectory_checks import ReadTrajectory, checked_trajectory
from taskslam.errors import RecordError, TrajectoryError
from taskslam.reading import is_there, open_file
from taskslam.record.number_table import NumberTable, read_number_table
from taskslam.record.trajectories import COLUMNS

_TUM = f"eight numbers '{' '.join(COLUMNS)}' separated by blanks"
_EUROC = "at least eight numbers 'timestamp x y z qw qx qy qz' separated by commas"
_KITTI = "twelve numbers separated by blanks, the rows of a 3 x 4 pose matrix"
_RIGID = 1e-3


def read_trajectory_file(source: str, times: Path | None = None) -> ReadTrajectory:
    """Read one trajectory. times: for KITTI files, seconds of each pose, one number a line.

    Raises TrajectoryError saying what is wrong, where, and what was expected.
    """
    path, topic = split_topic(source)
    if topic is not None or is_bag(path):
        return read_bag_trajectory(path, topic)
    try:
        if path.suffix.lower() == ".csv":
            return _read_euroc(path)
        if path.suffix.lower() != ".tum" and _words_of_first_line(path) == 12:
            return _read_kitti(path, times)
        return _read_tum(path)
    except RecordError as error:
        raise TrajectoryError(str(error)) from None


def split_topic(source: str) -> tuple[Path, str | None]:
    """`drive.bag:/odom` as path and topic; a path that exists as it stands has no topic."""
    head, colon, topic = source.rpartition(":")
    if colon and head and topic and not is_there(Path(source)) and is_bag(Path(head)):
        return Path(head), topic
    return Path(source), None


def _read_tum(path: Path) -> ReadTrajectory:
    table = read_number_table(path, 8, _TUM, "seconds", cut_off_allowed=True)
    return checked_trajectory(
        table.stamps, table.values[:, :3], table.values[:, 3:], _place(path, table), _notes(table)
    )


def _read_euroc(path: Path) -> ReadTrajectory:
    table = read_number_table(path, 8, _EUROC, "nanoseconds", separator=",", cut_off_allowed=True)
    quaternions = table.values[:, [4, 5, 6, 3]]
    return checked_trajectory(table.stamps, table.values[:, :3], quaternions, _place(path, table), _notes(table))


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
    off = np.abs(turns @ turns.transpose(0, 2, 1) - np.eye(3)).reshape(-1, 9)
    bad = (off > _RIGID).any(axis=1) | (np.linalg.det(turns) < 0)
    if bad.any():
        raise TrajectoryError(
            f"{place(int(np.argmax(bad)))}: expected a rotation in the first three columns of the matrix"
        )
    quaternions = Rotation.from_matrix(turns).as_quat() if len(turns) else np.empty((0, 4))
    quaternions[~finite] = np.nan
    return checked_trajectory(clock.stamps, rows[:, :, 3], quaternions, place)


def _words_of_first_line(path: Path) -> int:
    """How many words the first line of numbers has, as far as the first 64 KiB show it."""
    with open_file(path, "trajectory", TrajectoryError) as file:
        head = file.read(65536)
    lines = (line.split() for line in head.split(b"\n"))
    return next((len(words) for words in lines if words and words[0][:1] not in b"#%"), 0)


def _place(path: Path, table: NumberTable) -> Callable[[int], str]:
    return lambda row: f"{path}, line {table.lines[row]}" if len(table.lines) else str(path)


def _notes(table: NumberTable) -> tuple[str, ...]:
    return ("the last line was cut off and is left out",) if table.cut_off else ()
