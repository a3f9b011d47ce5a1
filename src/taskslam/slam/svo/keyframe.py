"""`Keyframe`: a picture and the points that it hosts; and what several of them hold together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.pyramid import Pyramid


class Points(NamedTuple):
    """Points as their host sees them.

    pixels: (N, 2) of level 0; levels: (N,) where each was found; normals: (N, 2) unit vectors across edgelets, zeros
    for corners; depths: (N, 4) states of their filters (`depth_filter.py`); failures: (N,) times in a row that a point
    was looked for in vain.
    """

    pixels: FloatArray
    levels: npt.NDArray[np.int64]
    normals: FloatArray
    depths: FloatArray
    failures: npt.NDArray[np.int64]

    def only(self, chosen: npt.NDArray[np.generic]) -> Points:
        """Some of them, by numbers or by a mask."""
        return Points(*(field[chosen] for field in self))


@dataclass(frozen=True, slots=True)
class Keyframe:
    """T_world_camera: (4, 4) of the left camera, optical axes; left: its picture."""

    T_world_camera: FloatArray
    left: Pyramid
    points: Points


def joined(parts: Sequence[Points]) -> Points:
    """The points of several one after another."""
    return Points(*(np.concatenate(fields) for fields in zip(*parts, strict=True)))


def rays_of(pixels: FloatArray, pinhole: Pinhole) -> FloatArray:
    """(N, 3) x/z, y/z, 1 of (N, 2) pixels of level 0."""
    return np.column_stack([(pixels - (pinhole.cx, pinhole.cy)) / pinhole.f, np.ones(len(pixels))])
