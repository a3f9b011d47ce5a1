"""Frames that are drawn when somebody first looks at them: one that a busy method drops is then never drawn.

A frame's noise is decided when the frame is taken, so whether and when it is drawn changes nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.measurements import Measurement, RgbdImages, StereoImages

Grey = npt.NDArray[np.uint8]


class LaterStereoImages(StereoImages):
    """A pair as `draw` will return it."""

    __slots__ = ("_draw",)
    _draw: Callable[[], tuple[Grey, Grey]]

    def __init__(self, stamp: int, draw: Callable[[], tuple[Grey, Grey]]) -> None:
        _keep(self, stamp=stamp, _draw=cache(draw))

    left = property(lambda self: self._draw()[0])
    right = property(lambda self: self._draw()[1])

    def work_out(self) -> None:
        """Draw, if that is still to be done."""
        self._draw()


class LaterRgbdImages(RgbdImages):
    """An image and its depth as `draw` will return them."""

    __slots__ = ("_draw",)
    _draw: Callable[[], tuple[Grey, npt.NDArray[np.float32]]]

    def __init__(self, stamp: int, draw: Callable[[], tuple[Grey, npt.NDArray[np.float32]]]) -> None:
        _keep(self, stamp=stamp, _draw=cache(draw))

    image = property(lambda self: self._draw()[0])
    depth = property(lambda self: self._draw()[1])

    def work_out(self) -> None:
        """Draw, if that is still to be done."""
        self._draw()


def _keep(measurement: Measurement, **values: Any) -> None:
    for name, value in values.items():
        object.__setattr__(measurement, name, value)  # a measurement is frozen
