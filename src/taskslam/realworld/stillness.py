"""When did the robot stand still? While no corner moves by a pixel (the published test, protocol 5.7)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taskslam.measurements import NANOSECONDS
from taskslam.realworld.looks import Look

MOST_MOTION_PX = 1.0
LONGEST_GAP = 2 * NANOSECONDS


@dataclass(frozen=True, slots=True)
class StillRun:
    """Looks `first` to `last` (included) of a list, in which the same tags stay where they are; begin, end: ns."""

    first: int
    last: int
    begin: int
    end: int


def motion_px(one: Look, other: Look) -> float:
    """How far (px) the corners of the tags in both images moved at most; infinite without a common tag."""
    before, after = one.corners(), other.corners()
    common = before.keys() & after.keys()
    return max((float(np.linalg.norm(after[i] - before[i], axis=1).max()) for i in common), default=float("inf"))


def still_runs(looks: Sequence[Look]) -> list[StillRun]:
    """Longest stretches, one after the other, in which each look agrees with the one before and with the first.

    Agreement with the first keeps a slow drift from passing for rest. Looks without a tag are skipped, gaps of more
    than 2 s end a run.
    """
    runs: list[StillRun] = []
    for row, look in enumerate(looks):
        if not look.corners():
            continue
        if runs:
            run = runs[-1]
            near = look.frame.stamp - run.end <= LONGEST_GAP
            if near and max(motion_px(looks[run.last], look), motion_px(looks[run.first], look)) < MOST_MOTION_PX:
                runs[-1] = StillRun(run.first, row, run.begin, look.frame.stamp)
                continue
        runs.append(StillRun(row, row, look.frame.stamp, look.frame.stamp))
    return runs
