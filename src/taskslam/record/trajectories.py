"""Trajectories in the TUM text form, which evo and most SLAM tools read: `timestamp tx ty tz qx qy qz qw`.

Stamps are seconds in the file, written with nine decimals and read without rounding: integer nanoseconds survive.
Numbers are written by repr, so the same trajectory always gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from taskslam.errors import RecordError
from taskslam.files import write_whole
from taskslam.geometry import SE2, FloatArray, wrap
from taskslam.measurements import NANOSECONDS
from taskslam.record.number_table import read_number_table

COLUMNS = ("timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw")
HEADER = f"# {' '.join(COLUMNS)}"
TUM_LINE = f"eight finite numbers '{' '.join(COLUMNS)}' separated by blanks, with a unit quaternion"
UNIT_TOLERANCE = 2e-2
"""How far a quaternion's length may be from 1, for every reader: what two decimals leave of it."""


@dataclass(frozen=True)
class Trajectory:
    """Planar poses over time. stamps: (N,) int64 ns; poses: (N, 3) x, y in metres and theta in radians."""

    stamps: npt.NDArray[np.int64]
    poses: FloatArray

    def __len__(self) -> int:
        """Number of poses."""
        return len(self.stamps)


@dataclass(frozen=True)
class SpatialTrajectory:
    """Poses in space over time. stamps: (N,) int64 ns; positions: (N, 3) metres; quaternions: (N, 4) unit, x y z w."""

    stamps: npt.NDArray[np.int64]
    positions: FloatArray
    quaternions: FloatArray

    def __len__(self) -> int:
        """Number of poses."""
        return len(self.stamps)

    def __getitem__(self, rows: slice | npt.NDArray[np.int64] | npt.NDArray[np.bool_]) -> SpatialTrajectory:
        """The poses at some rows: a slice, indices or a mask."""
        return SpatialTrajectory(self.stamps[rows], self.positions[rows], self.quaternions[rows])

    @staticmethod
    def from_matrices(stamps: npt.NDArray[np.int64], poses: FloatArray) -> SpatialTrajectory:
        """From (N, 4, 4) rigid transforms."""
        from scipy.spatial.transform import Rotation

        quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat() if len(poses) else np.empty((0, 4))
        return SpatialTrajectory(stamps, poses[:, :3, 3].copy(), quaternions)

    def matrices(self) -> FloatArray:
        """(N, 4, 4) rigid transforms."""
        from scipy.spatial.transform import Rotation

        poses = np.tile(np.eye(4), (len(self), 1, 1))
        poses[:, :3, 3] = self.positions
        if len(self):
            poses[:, :3, :3] = Rotation.from_quat(self.quaternions).as_matrix()
        return poses

    def planar(self) -> Trajectory:
        """Projected to SE(2): x, y and yaw = atan2(R10, R00) (protocol 5.1)."""
        x, y, z, w = self.quaternions.T
        yaw = np.arctan2(2 * (x * y + w * z), 1 - 2 * (y**2 + z**2))
        return Trajectory(self.stamps, np.column_stack([self.positions[:, :2], yaw]))


def write_trajectory(path: Path, trajectory: Trajectory | SpatialTrajectory) -> None:
    """Write a TUM file, whole or not at all. Raises RecordError for a non-finite pose, DiskFullError."""
    if isinstance(trajectory, Trajectory):
        numbers, rows = trajectory.poses, _planar_rows
    else:
        numbers, rows = np.hstack([trajectory.positions, trajectory.quaternions]), _spatial_rows
    if not np.isfinite(numbers).all():
        row = int(np.argmin(np.isfinite(numbers).all(axis=1)))
        raise RecordError(f"{path}: pose {row} is not finite; expected finite numbers in every pose")
    write_whole(path, "\n".join([HEADER, *rows(trajectory.stamps, numbers)]) + "\n")


def read_trajectory(path: Path) -> Trajectory:
    """Read a TUM file as planar poses: yaw is that of the full rotation. Raises RecordError naming the line."""
    return read_spatial_trajectory(path).planar()


def read_spatial_trajectory(path: Path) -> SpatialTrajectory:
    """Read a TUM file as poses in space, quaternions normalised. Raises RecordError naming the line."""
    table = read_number_table(path, len(COLUMNS), TUM_LINE, "seconds")
    quaternions, bad = unit_quaternions(table.values[:, 3:])
    bad |= ~np.isfinite(table.values).all(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        found = " ".join([seconds(int(table.stamps[row])), *(repr(number) for number in table.values[row].tolist())])
        raise RecordError(f"{path}, line {table.lines[row]}: expected {TUM_LINE}, found '{found}'")
    return SpatialTrajectory(table.stamps, table.values[:, :3], quaternions)


def unit_quaternions(quaternions: FloatArray) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """(N, 4) quaternions normalised, and a mask of those whose norm is not 1 within UNIT_TOLERANCE."""
    norms = np.sqrt(np.einsum("ij,ij->i", quaternions, quaternions))
    bad = ~(np.abs(norms - 1.0) <= UNIT_TOLERANCE)
    return quaternions / np.where(bad, 1.0, norms)[:, None], bad


def seconds(stamp: int) -> str:
    """Integer nanoseconds as seconds with nine decimals, exactly."""
    whole, rest = divmod(abs(stamp), NANOSECONDS)
    return f"{'-' if stamp < 0 else ''}{whole}.{rest:09d}"


def planar_line(stamp: int, pose: SE2) -> str:
    """One pose as a line of a file that is written while it grows, after `HEADER`; without the line's end."""
    return next(iter(_planar_rows(np.array([stamp]), np.array([[pose.x, pose.y, pose.theta]]))))


def _planar_rows(stamps: npt.NDArray[np.int64], numbers: FloatArray) -> Iterable[str]:
    half = wrap(numbers[:, 2]) / 2
    columns = np.column_stack([numbers[:, :2], np.sin(half), np.cos(half)]).tolist()
    for stamp, (x, y, qz, qw) in zip(stamps.tolist(), columns, strict=True):
        yield f"{seconds(stamp)} {x!r} {y!r} 0 0 0 {qz!r} {qw!r}"


def _spatial_rows(stamps: npt.NDArray[np.int64], numbers: FloatArray) -> Iterable[str]:
    for stamp, row in zip(stamps.tolist(), numbers.tolist(), strict=True):
        yield " ".join([seconds(stamp), *map(repr, row)])
