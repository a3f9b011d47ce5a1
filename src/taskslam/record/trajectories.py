"""Trajectories in the TUM text form, which evo and most SLAM tools read: `timestamp tx ty tz qx qy qz qw`.

Stamps are seconds in the file, written with nine decimals and read without rounding: integer nanoseconds survive.
Numbers are written by repr, so the same trajectory always gives the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
import numpy.typing as npt

from taskslam.errors import RecordError
from taskslam.geometry import FloatArray, wrap
from taskslam.measurements import NANOSECONDS
from taskslam.record.files import write_whole

HEADER = "# timestamp tx ty tz qx qy qz qw"


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
    """Poses in space over time. stamps: (N,) int64 ns; poses: (N, 4, 4) rigid transforms, metres."""

    stamps: npt.NDArray[np.int64]
    poses: FloatArray

    def __len__(self) -> int:
        """Number of poses."""
        return len(self.stamps)

    def planar(self) -> Trajectory:
        """Projected to SE(2): x, y and yaw = atan2(R10, R00) (protocol 5.1)."""
        yaw = np.arctan2(self.poses[:, 1, 0], self.poses[:, 0, 0])
        return Trajectory(self.stamps, np.column_stack([self.poses[:, :2, 3], yaw]))


def write_trajectory(path: Path, trajectory: Trajectory | SpatialTrajectory) -> None:
    """Write a TUM file, whole or not at all. Raises RecordError for a non-finite pose, DiskFullError."""
    if not np.isfinite(trajectory.poses).all():
        row = int(np.argmin(np.isfinite(trajectory.poses).reshape(len(trajectory), -1).all(axis=1)))
        raise RecordError(f"{path}: pose {row} is not finite; expected finite numbers in every pose")
    rows = _planar_rows(trajectory) if isinstance(trajectory, Trajectory) else _spatial_rows(trajectory)
    write_whole(path, "\n".join([HEADER, *rows]) + "\n")


def read_trajectory(path: Path) -> Trajectory:
    """Read a TUM file as planar poses: yaw is that of the full rotation. Raises RecordError naming the line."""
    stamps, t, q = _read_columns(path)
    # atan2(R10, R00) of the rotation, written out in the quaternion's terms.
    yaw = np.arctan2(2 * (q[:, 0] * q[:, 1] + q[:, 3] * q[:, 2]), 1 - 2 * (q[:, 1] ** 2 + q[:, 2] ** 2))
    return Trajectory(stamps, np.column_stack([t[:, :2], yaw]))


def read_spatial_trajectory(path: Path) -> SpatialTrajectory:
    """Read a TUM file as poses in space. Raises RecordError naming the line."""
    from scipy.spatial.transform import Rotation

    stamps, t, q = _read_columns(path)
    poses = np.tile(np.eye(4), (len(stamps), 1, 1))
    poses[:, :3, 3] = t
    if len(stamps):
        poses[:, :3, :3] = Rotation.from_quat(q).as_matrix()
    return SpatialTrajectory(stamps, poses)


def seconds(stamp: int) -> str:
    """Integer nanoseconds as seconds with nine decimals, exactly."""
    whole, rest = divmod(abs(stamp), NANOSECONDS)
    return f"{'-' if stamp < 0 else ''}{whole}.{rest:09d}"


def _planar_rows(trajectory: Trajectory) -> Iterable[str]:
    half = wrap(trajectory.poses[:, 2]) / 2
    columns = np.column_stack([trajectory.poses[:, :2], np.sin(half), np.cos(half)]).tolist()
    for stamp, (x, y, qz, qw) in zip(trajectory.stamps.tolist(), columns, strict=True):
        yield f"{seconds(stamp)} {x!r} {y!r} 0 0 0 {qz!r} {qw!r}"


def _spatial_rows(trajectory: SpatialTrajectory) -> Iterable[str]:
    from scipy.spatial.transform import Rotation

    if not len(trajectory):
        return
    quaternions = Rotation.from_matrix(trajectory.poses[:, :3, :3]).as_quat().tolist()
    positions = trajectory.poses[:, :3, 3].tolist()
    for stamp, t, q in zip(trajectory.stamps.tolist(), positions, quaternions, strict=True):
        yield " ".join([seconds(stamp), *(repr(number) for number in [*t, *q])])


def _read_columns(path: Path) -> tuple[npt.NDArray[np.int64], FloatArray, FloatArray]:
    """Stamps (N,), positions (N, 3) and unit quaternions (N, 4) x y z w."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise RecordError(f"{path}: the trajectory cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise RecordError(f"{path}: expected UTF-8 text with eight numbers a line") from None
    stamps: list[int] = []
    rows: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.startswith("#"):
            continue
        words = line.split()
        try:
            values = [float(word) for word in words[1:]]
            stamp = int((Decimal(words[0]) * NANOSECONDS).to_integral_value())
        except (ValueError, InvalidOperation, OverflowError):
            values, stamp = [], 0
        norm = math.hypot(*values[3:])
        if len(values) != 7 or not all(map(math.isfinite, values)) or abs(norm - 1) > 1e-3:
            raise RecordError(
                f"{path}, line {number}: expected eight finite numbers 'timestamp tx ty tz qx qy qz qw' "
                f"with a unit quaternion, found {line.strip()[:100]!r}"
            )
        stamps.append(stamp)
        rows.append([*values[:3], *(value / norm for value in values[3:])])
    table = np.array(rows, dtype=np.float64).reshape(-1, 7)
    return np.array(stamps, dtype=np.int64), table[:, :3], table[:, 3:]
