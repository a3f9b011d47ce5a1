"""The part of a gyro's bias that is another after each start, and then walks."""

from __future__ import annotations

import math

import numpy as np

from taskslam.geometry import FloatArray
from taskslam.simulation.streams import stream


class WalkingBias:
    """Of `axes` axes of the gyro `name` after the count-th reset.

    turn_on: standard deviation of its first value, rad/s; walk: of its random walk, rad/s per square root of a second.
    """

    def __init__(self, seed: int, name: str, count: int, axes: int, turn_on: float | None, walk: float | None) -> None:
        self._axes = axes
        self._walk = walk or 0.0
        self._value = (turn_on or 0.0) * stream(seed, f"{name}_turn_on", count).standard_normal(axes)
        self._steps = stream(seed, f"{name}_walk", count)

    def after(self, dt: float) -> FloatArray:
        """(axes,) rad/s, dt seconds after the last call."""
        if self._walk:
            self._value = self._value + self._walk * math.sqrt(dt) * self._steps.standard_normal(self._axes)
        return np.asarray(self._value)
