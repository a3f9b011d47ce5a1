"""How long the method took over each frame of a round, and how late its answer came: `frames.txt` beside the poses.

It holds what this machine's clock said, so that two runs of the same spec differ in it, and in run.json, alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from taskslam.files import write_whole
from taskslam.geometry import FloatArray
from taskslam.record.number_table import read_number_table
from taskslam.record.trajectories import seconds

FRAMES = "frames.txt"
_COLUMNS = "stamp compute latency"


@dataclass(frozen=True)
class FrameTimes:
    """stamps: (N,) int64 ns of frames that the method saw; compute_s: (N,) CPU seconds that it spent on each.

    latency_s: (N,) from stamp to answer in simulated time, by the run's kind of latency.
    """

    stamps: npt.NDArray[np.int64]
    compute_s: FloatArray
    latency_s: FloatArray

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.stamps)


def write_frame_times(path: Path, rows: list[tuple[int, int, int]]) -> None:
    """Write (stamp, compute, latency) of each frame, all in ns, as seconds. Raises DiskFullError."""
    lines = [" ".join(seconds(number) for number in row) for row in rows]
    write_whole(path, "\n".join([f"# {_COLUMNS}", *lines]) + "\n")


def read_frame_times(path: Path) -> FrameTimes:
    """Read what `write_frame_times` wrote. Raises RecordError naming the line."""
    table = read_number_table(path, 3, f"three numbers '{_COLUMNS}', in seconds", "seconds")
    order = np.argsort(table.stamps, kind="stable")
    values = np.where(np.isfinite(table.values), np.clip(table.values, 0.0, 1e6), 0.0)[order]
    return FrameTimes(table.stamps[order], values[:, 0], values[:, 1])


NO_FRAMES = FrameTimes(np.empty(0, np.int64), np.empty(0), np.empty(0))
"""Of a round that kept none: a method without frames, a robot that was only measured, a run of an older version."""
