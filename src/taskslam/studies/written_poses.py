"""What a run looks like on the ground truth, as files: the aligned trajectory, and the errors of every pose."""

from __future__ import annotations

import re
from pathlib import Path

from taskslam.evaluation.trajectory_errors import absolute_errors
from taskslam.files import write_whole
from taskslam.record.trajectories import seconds, write_trajectory
from taskslam.studies.study_comparison import AlignedRun

_ODD = re.compile(r"[^A-Za-z0-9_.-]+")


def write_poses(folder: Path, sequence: str, method: str, run: AlignedRun) -> list[Path]:
    """Write OUT/poses/SEQUENCE/METHOD/FILE.tum and .csv (timestamp s, ate_m, rotation_rad); returns their paths.

    Stamps are the run's own. Raises DiskFullError.
    """
    parts = [_ODD.sub("_", part).strip(".") or "run" for part in (sequence, method, Path(run.file).stem)]
    place = folder.joinpath("poses", *parts[:2])
    if Path(run.file).name == "estimate.tum":  # a round of a run directory
        parts[2] = _ODD.sub("_", Path(run.file).resolve().parent.name)
    place.mkdir(parents=True, exist_ok=True)
    errors = absolute_errors(run.truth, run.aligned)
    rows = [
        f"{seconds(stamp)},{metres!r},{radians!r}"
        for stamp, metres, radians in zip(
            run.aligned.stamps.tolist(), errors.translation.tolist(), errors.rotation.tolist(), strict=True
        )
    ]
    trajectory, table = place / f"{parts[2]}.tum", place / f"{parts[2]}.csv"
    write_trajectory(trajectory, run.aligned)
    write_whole(table, "\n".join(["timestamp,ate_m,rotation_rad", *rows]) + "\n")
    return [trajectory, table]
