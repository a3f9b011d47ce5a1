"""Reading one trial directory of the published benchmark (protocol 1.6): what was planned, visited and true.

    planned_waypoints.txt           x y theta, the goals in visiting order
    visited_waypoints_nav_info.txt  timestamp x y theta goal loop, after each pause
    visited_waypoints.txt           the same without the two indices
    act_poses.txt, act_odoms.txt    ground truth in `map`
    robot_odoms.txt                 wheel odometry

Visits are keyed by the goal index of the nav_info file (5.9 e). Without it the planned pose that each visit logs tells
which goal it was, in the order of the visits. SLAM's own poses (est_slam_poses.txt) are raw poses of a sensor in a
frame of its own, whose extrinsics the files do not hold (5.9 j): they are not read.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from taskslam.errors import DatasetError, RecordError
from taskslam.geometry import SE2, FloatArray, wrap
from taskslam.reading import is_file
from taskslam.record.number_table import NumberTable, read_number_table
from taskslam.record.trajectories import SpatialTrajectory, Trajectory, unit_quaternions

PLANNED, VISITED, NAV_INFO = "planned_waypoints.txt", "visited_waypoints.txt", "visited_waypoints_nav_info.txt"
TRUE_POSES, TRUE_ODOMS, ROBOT_ODOMS = "act_poses.txt", "act_odoms.txt", "robot_odoms.txt"
NEAR = 50_000_000  # ns: a true pose farther from a visit in time is not that of the visit (5.1)
_SAME_POSE = 1e-3  # m, rad: the files hold six decimals
_NO_POSES = Trajectory(np.empty(0, np.int64), np.empty((0, 3)))


@dataclass(frozen=True, slots=True)
class Visit:
    """A goal was reached: its index in the sequence, in which loop, and when (ns, at the end of the pause)."""

    goal: int
    loop: int
    stamp: int


@dataclass(frozen=True)
class Trial:
    """One trial. goals: (N, 3), empty if they are not in it; truth, odometry: empty if absent. missing: counts."""

    folder: Path
    goals: FloatArray
    visits: tuple[Visit, ...]
    truth: Trajectory
    odometry: Trajectory
    missing: Counter[str] = field(default_factory=Counter)

    def true_pose_at(self, stamp: int) -> SE2 | None:
        """The true pose nearest to an instant, or None if there is none within 50 ms (a gap, 5.9 g)."""
        stamps = self.truth.stamps
        if not len(stamps):
            return None
        after = int(np.searchsorted(stamps, stamp))
        row = min((r for r in (after - 1, after) if 0 <= r < len(stamps)), key=lambda r: abs(int(stamps[r]) - stamp))
        return SE2(*self.truth.poses[row].tolist()) if abs(int(stamps[row]) - stamp) <= NEAR else None


def is_trial(folder: Path) -> bool:
    """Whether a folder looks like a trial: it has one of the files that matter."""
    return any(is_file(folder / name) for name in (PLANNED, VISITED, NAV_INFO, TRUE_POSES, TRUE_ODOMS))


def read_goals(folder: Path) -> FloatArray:
    """(N, 3) planned goals in visiting order, headings as written; (0, 3) without the file. Raises DatasetError."""
    path = folder / PLANNED
    if not is_file(path):
        return np.empty((0, 3))
    table = _table(path, 3, "'x y theta'", stamped=False)
    if not np.isfinite(table.values).all():
        raise DatasetError(f"{path}: holds a goal that is not finite")
    return table.values


def read_trial(folder: Path, goals: FloatArray) -> Trial:
    """Read a trial. goals: of the whole set of trials, for one that lacks its own.

    Raises:
        DatasetError: a file that is there cannot be read, or a visit is at no planned goal.
    """
    missing: Counter[str] = Counter()
    truth = _poses(folder, (TRUE_POSES, TRUE_ODOMS), missing)
    odometry = _poses(folder, (ROBOT_ODOMS,), missing)
    return Trial(folder, goals, _visits(folder, goals, missing), truth, odometry, missing)


def _visits(folder: Path, goals: FloatArray, missing: Counter[str]) -> tuple[Visit, ...]:
    if is_file(folder / NAV_INFO):
        visits = _indexed_visits(folder / NAV_INFO, goals, missing)
    elif is_file(folder / VISITED):
        missing[f"trials without {NAV_INFO}: goals told apart by visiting order"] += 1
        visits = _visits_in_order(folder / VISITED, goals, missing)
    else:
        missing[f"trials without {VISITED}: no goal reached, or the log lost"] += 1
        return ()
    first: dict[tuple[int, int], Visit] = {}
    for visit in sorted(visits, key=lambda visit: visit.stamp):
        if first.setdefault((visit.loop, visit.goal), visit) is not visit:
            missing["visits left out: the goal was visited before in the same loop"] += 1
    return tuple(first.values())


def _indexed_visits(path: Path, goals: FloatArray, missing: Counter[str]) -> list[Visit]:
    table = _table(path, 6, "'timestamp x y theta wpt_index loop_index'", True, missing)
    visits = []
    for stamp, line, values in zip(table.stamps.tolist(), table.lines.tolist(), table.values, strict=True):
        goal, loop = values[3:].tolist()
        if not (goal.is_integer() and 0 <= goal < len(goals) and loop.is_integer() and 0 <= loop < 1000):
            raise DatasetError(
                f"{path}, line {line}: goal {goal:g} in loop {loop:g}; expected whole numbers, of {len(goals)} goals"
            )
        if not _same(values[:3], goals[int(goal)]):
            raise DatasetError(f"{path}, line {line}: the pose is not that of goal {goal:g} in {PLANNED}")
        visits.append(Visit(int(goal), int(loop), stamp))
    return visits


def _visits_in_order(path: Path, goals: FloatArray, missing: Counter[str]) -> list[Visit]:
    """Each visit is at the next goal that has the planned pose which it logs; past the last goal a new loop begins."""
    table = _table(path, 4, "'timestamp x y theta'", True, missing)
    visits: list[Visit] = []
    place = 0  # counts goals over all loops
    for stamp, line, values in zip(table.stamps.tolist(), table.lines.tolist(), table.values, strict=True):
        ahead = next((n for n in range(len(goals)) if _same(values, goals[(place + n) % len(goals)])), None)
        if ahead is None:
            raise DatasetError(f"{path}, line {line}: the pose is that of no goal in {PLANNED}")
        place += ahead
        visits.append(Visit(place % len(goals), place // len(goals), stamp))
        place += 1
    return visits


def _same(pose: FloatArray, goal: FloatArray) -> bool:
    near = np.abs(pose[:2] - goal[:2]).max() <= _SAME_POSE
    return bool(near and abs(float(wrap(pose[2] - goal[2]))) <= _SAME_POSE)


def _poses(folder: Path, names: tuple[str, ...], missing: Counter[str]) -> Trajectory:
    """The first of these files that is there, as planar poses in stamp order; rows that are no pose are left out."""
    path = next((folder / name for name in names if is_file(folder / name)), None)
    if path is None:
        missing[f"trials without {' or '.join(names)}"] += 1
        return _NO_POSES
    columns = 14 if path.name in (TRUE_ODOMS, ROBOT_ODOMS) else 8
    table = _table(path, columns, f"{columns} numbers 'timestamp tx ty tz qx qy qz qw ...'", True, missing)
    quaternions, bad = unit_quaternions(table.values[:, 3:7])
    bad |= ~np.isfinite(table.values[:, :7]).all(axis=1)
    if bad.any():
        missing[f"rows of {path.name} that are no finite pose"] += int(bad.sum())
    stamps, kept = np.unique(table.stamps[~bad], return_index=True)
    return SpatialTrajectory(stamps, table.values[~bad][kept, :3], quaternions[~bad][kept]).planar()


def _table(path: Path, columns: int, expected: str, stamped: bool, missing: Counter[str] | None = None) -> NumberTable:
    try:
        table = read_number_table(path, columns, expected, "seconds" if stamped else None, cut_off_allowed=True)
    except RecordError as error:
        raise DatasetError(str(error)) from error
    if table.cut_off and missing is not None:
        missing[f"cut-off last lines of {path.name}"] += 1
    return table
