"""Step curves: how many of some values lie below x."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from taskslam.geometry import FloatArray


def step_corners(values: Sequence[float], planned: int, low: float, high: float) -> FloatArray:
    """(K, 2) corners of the step curve from low to high: a value, and the share of `planned` values up to it."""
    corners, share = [(low, 0.0)], 0.0
    for count, value in enumerate(sorted(value for value in values if value < high), start=1):
        at = max(value, low)
        corners += [(at, share), (at, count / planned)]
        share = count / planned
    return np.array([*corners, (high, share)])
