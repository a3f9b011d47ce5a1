"""A trajectory at other times: positions in a straight line between two poses, rotations along the shorter arc."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray
from taskslam.record.trajectories import SpatialTrajectory

LONGEST_GAP = 3.0
"""Poses are not interpolated over more than so many times the usual (median) step: there the method was lost."""


def resampled(
    trajectory: SpatialTrajectory, stamps: npt.NDArray[np.int64]
) -> tuple[SpatialTrajectory, npt.NDArray[np.bool_]]:
    """The poses at (N,) ascending stamps (ns), and (N,) whether there is one: not outside and in gaps.

    Rows without a pose hold the nearest one. Rotations are interpolated as K. Shoemake's slerp (SIGGRAPH 1985). A pose
    at a stamp of the trajectory itself is that pose.
    """
    own = trajectory.stamps
    after = np.clip(np.searchsorted(own, stamps, side="left"), 1, max(len(own) - 1, 1))
    if len(own) < 2:
        rows = np.zeros(len(stamps), dtype=np.int64)
        there = stamps == own[0] if len(own) else np.zeros(len(stamps), dtype=np.bool_)
        return SpatialTrajectory(stamps, trajectory.positions[rows], trajectory.quaternions[rows]), there
    before = after - 1
    step = own[after] - own[before]
    share = np.clip((stamps - own[before]) / step, 0.0, 1.0)
    inside = (stamps >= own[0]) & (stamps <= own[-1])
    exact = (stamps == own[before]) | (stamps == own[after])
    usable = inside & (exact | (step <= LONGEST_GAP * np.median(np.diff(own))))
    a, b = trajectory.positions[before], trajectory.positions[after]
    positions = np.where(share[:, None] == 1.0, b, a + share[:, None] * (b - a))
    turns = _slerp(trajectory.quaternions[before], trajectory.quaternions[after], share)
    return SpatialTrajectory(stamps, positions, turns), usable


def _slerp(a: FloatArray, b: FloatArray, share: FloatArray) -> FloatArray:
    """(N, 4) unit quaternions between a and b along the shorter arc."""
    cosine = np.einsum("ij,ij->i", a, b)
    b = np.where(cosine[:, None] < 0.0, -b, b)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    sine = np.sin(angle)
    near = sine < 1e-9
    safe = np.where(near, 1.0, sine)
    first = np.where(near, 1.0 - share, np.sin((1.0 - share) * angle) / safe)
    second = np.where(near, share, np.sin(share * angle) / safe)
    turned: FloatArray = first[:, None] * a + second[:, None] * b
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    return turned
