"""A recorded trajectory read at other instants than those of its own poses."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray, wrap
from taskslam.measurements import NANOSECONDS
from taskslam.record import Trajectory

GAP_S = 0.5  # between two poses that are further apart in time than this, nothing is known


def poses_at(track: Trajectory, stamps: npt.NDArray[np.int64]) -> FloatArray:
    """(N, 3) x, y in metres and theta in radians at (N,) sorted stamps (ns), linear between two poses.

    NaN before the first pose, after the last one, and in gaps of more than GAP_S.
    """
    poses = np.full((len(stamps), 3), np.nan)
    if len(track) < 2:
        return poses
    times = (stamps - track.stamps[0]) / NANOSECONDS
    known = (track.stamps - track.stamps[0]) / NANOSECONDS
    for axis, values in enumerate((track.poses[:, 0], track.poses[:, 1], np.unwrap(track.poses[:, 2]))):
        poses[:, axis] = np.interp(times, known, values, left=np.nan, right=np.nan)
    poses[:, 2] = wrap(poses[:, 2])
    after = np.clip(np.searchsorted(known, times), 1, len(known) - 1)
    poses[(known[after] - known[after - 1] > GAP_S) & (times != known[after]) & (times != known[after - 1])] = np.nan
    return poses
