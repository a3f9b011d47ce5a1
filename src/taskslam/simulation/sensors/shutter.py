"""When the rows of a picture are exposed: all at once, or, by a rolling shutter, one after another.

A rolling picture is drawn in bands of rows, each from where the base is when its middle row is exposed: so many of them
that neighbouring bands lie about half a pixel apart, and one while the robot stands. Its stamp is that of the last row,
as that of a scan is that of its last ray (decision 002).
"""

from __future__ import annotations

import math

import numpy as np

from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.robot import Camera
from taskslam.simulation.motion import Motion

_APART = 0.5  # pixels
_NEAR = 0.7  # m; what passes nearer than this moves by more than that from band to band
_FEWEST_ROWS = 4  # of a band


class Shutter:
    """Of one camera."""

    def __init__(self, camera: Camera) -> None:
        self._readout = round((camera.readout or 0.0) * NANOSECONDS)
        self._focal = camera.focal_length
        self._most = max(1, camera.height // _FEWEST_ROWS)

    def poses(self, stamp: int, motion: Motion) -> FloatArray:
        """(B, 3) poses x, y, theta of the base in `map` for B bands of the picture of `stamp`, from top to bottom."""
        if not self._readout:
            return motion.pose_at([stamp])
        first, last = motion.pose_at([stamp - self._readout, stamp])
        moved = math.hypot(*(last - first)[:2]) / _NEAR + abs(last[2] - first[2])
        bands = min(max(1, math.ceil(self._focal * moved / _APART)), self._most)
        if bands == 1:
            return motion.pose_at([stamp])
        ages = (1.0 - (np.arange(bands) + 0.5) / bands) * self._readout
        return motion.pose_at(stamp - np.round(ages).astype(np.int64))
