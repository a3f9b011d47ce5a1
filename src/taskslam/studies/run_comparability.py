"""What makes runs of a method comparable: common times where they share no stamps, and which of them diverged."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from taskslam.evaluation.trajectory_resampling import resampled
from taskslam.studies.study_comparison import AlignedRun

FARTHER = 3.0
"""A run has diverged if its ATE is more than so many times the median of the method's runs..."""
OUTSIDE = 3.5
"""...and more than so many deviations above it (1.4826 times the median of absolute deviations from the median)."""
_ENOUGH = 4


def at_common_times(runs: Sequence[AlignedRun]) -> tuple[list[AlignedRun], npt.NDArray[np.int64]]:
    """The runs interpolated to the stamps of the one that has fewest poses, and (F, R) their rows, -1 in gaps.

    For runs whose tools stamped the same drive each in its own way: live, at a rate of their own, a millisecond off.
    """
    stamps = min((run.aligned.stamps for run in runs), key=len)
    found: list[AlignedRun] = []
    rows = np.tile(np.arange(len(stamps))[:, None], (1, len(runs)))
    for column, run in enumerate(runs):
        aligned, there = resampled(run.aligned, stamps)
        raw, truth = (resampled(trajectory, stamps)[0] for trajectory in (run.raw, run.truth))
        rows[~there, column] = -1
        found.append(replace(run, aligned=aligned, raw=raw, truth=truth))
    return found, rows[(rows >= 0).any(axis=1)]


def diverged(rmse: Sequence[float]) -> list[int]:
    """Which runs are so far off (RMSE of ATE, m) that they alone would decide what is said of the method.

    See FARTHER and OUTSIDE; below four runs none, for then nobody can say which one is the odd one.
    """
    if len(rmse) < _ENOUGH:
        return []
    middle = statistics.median(rmse)
    spread = 1.4826 * statistics.median(abs(value - middle) for value in rmse)
    return [run for run, value in enumerate(rmse) if value > FARTHER * middle and value > middle + OUTSIDE * spread]
