"""Frames are drawn when somebody first looks at them, and once while the robot stands.

One that a busy method drops is then never drawn.

A frame's noise is decided when the frame is taken, so whether and when it is drawn changes nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, Generic, TypeVar

import numpy as np

from taskslam.geometry import SE2, FloatArray
from taskslam.measurements import Measurement, RgbdImages, StereoImages


class _Later(Measurement):
    """What `draw` will return, asked once."""

    __slots__ = ()
    _draw: Callable[[], tuple[Any, Any]]

    def __init__(self, stamp: int, draw: Callable[[], tuple[Any, Any]]) -> None:
        for name, value in (("stamp", stamp), ("_draw", cache(draw))):
            object.__setattr__(self, name, value)  # a measurement is frozen

    def work_out(self) -> None:
        """Draw, if that is still to be done."""
        self._draw()


class LaterStereoImages(_Later, StereoImages):
    """A pair: left and right."""

    __slots__ = ("_draw",)

    left = property(lambda self: self._draw()[0])
    right = property(lambda self: self._draw()[1])


class LaterRgbdImages(_Later, RgbdImages):
    """An image and its depth."""

    __slots__ = ("_draw",)

    image = property(lambda self: self._draw()[0])
    depth = property(lambda self: self._draw()[1])


Seen = TypeVar("Seen")


class WhileStanding(Generic[Seen]):
    """What `look` sees from the last poses of the base: while the robot stands, it sees the same."""

    def __init__(self) -> None:
        self._last: tuple[FloatArray, Seen] | None = None

    def seen(self, poses: FloatArray, look: Callable[[FloatArray], Seen]) -> Seen:
        """From (B, 3) poses of the base in `map`, of bands of rows; look: takes them as (B, 4, 4) matrices."""
        if self._last is None or not np.array_equal(self._last[0], poses):
            self._last = poses, look(np.stack([SE2(*pose).matrix() for pose in poses.tolist()]))
        return self._last[1]
