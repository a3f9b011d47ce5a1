"""`Frame`: the features of one pair of pictures, and which points of the map they are."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.gf_gg.settings import GfGgSettings
from taskslam.slam.vision.binary_words import Words
from taskslam.slam.vision.orb_features import OrbExtractor
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.pyramid import build_pyramid, grey
from taskslam.slam.vision.stereo_matching import match_stereo

Ints = npt.NDArray[np.int64]
CELL = 16  # pixels, of the grid in which features are looked for
_STEREO_LEVELS = 4
_LEAST_DISPARITY = 0.5  # pixels


class Features(NamedTuple):
    """What kernels read of a frame.

    seen: (N, 3) u, v, and u in the right picture or NaN. octaves: (N,). descriptors: (N, 4). Of the grid's cells, row
    by row, cell c holds features[start[c] : start[c + 1]]; columns: cells in a row.
    """

    seen: FloatArray
    octaves: Ints
    descriptors: Words
    start: Ints
    features: Ints
    columns: int


@dataclass
class Frame:
    """stamp: ns. points: (N,) rows of the map's points, or -1. T_camera_world: (4, 4). variances: (N,) of a pixel."""

    stamp: int
    features: Features
    variances: FloatArray
    T_camera_world: FloatArray = field(default_factory=lambda: np.eye(4))
    points: Ints = field(default_factory=lambda: np.empty(0, np.int64))

    def __len__(self) -> int:
        return len(self.features.octaves)

    def depths(self, pinhole: Pinhole) -> FloatArray:
        """(N,) metres along the optical axis by the disparity, or NaN."""
        seen = self.features.seen
        depths: FloatArray = pinhole.f * pinhole.baseline / (seen[:, 0] - seen[:, 2])
        return depths


class FrameMaker:
    """Finds the features of pairs, and how far they are."""

    def __init__(self, settings: GfGgSettings, pinhole: Pinhole) -> None:
        s = self._settings = settings
        self._largest_disparity = pinhole.f  # of a point as near as the baseline is long
        self._least_disparity = max(pinhole.f * pinhole.baseline / s.largest_depth, _LEAST_DISPARITY)
        self._extractor = OrbExtractor(s.features, s.scale, s.levels, s.fast_threshold, s.lowest_fast_threshold)

    def make(self, left: npt.NDArray[np.uint8], right: npt.NDArray[np.uint8], stamp: int) -> Frame:
        """Of a rectified pair of (H, W) or (H, W, 3) pictures."""
        s, image = self._settings, np.array(grey(left), order="C")  # a copy: of one type, whoever owns it
        found = self._extractor.find(image)
        disparities = match_stereo(
            build_pyramid(left, _STEREO_LEVELS),
            build_pyramid(right, _STEREO_LEVELS),
            found.pixels,
            self._largest_disparity,
            s.least_correlation,
        )
        disparities[disparities < self._least_disparity] = np.nan
        seen = np.column_stack((found.pixels, found.pixels[:, 0] - disparities))
        columns, rows = image.shape[1] // CELL + 1, image.shape[0] // CELL + 1
        start, features = _grid(seen, rows, columns)
        variances = np.power(s.scale, 2.0 * found.octaves).astype(np.float64)
        frame = Frame(stamp, Features(seen, found.octaves, found.descriptors, start, features, columns), variances)
        frame.points = np.full(len(seen), -1, np.int64)
        return frame


@njit(cache=True)
def _grid(seen: FloatArray, rows: int, columns: int) -> tuple[Ints, Ints]:
    start = np.zeros(rows * columns + 1, np.int64)
    cells = np.empty(len(seen), np.int64)
    for i in range(len(seen)):
        cells[i] = int(seen[i, 1]) // CELL * columns + int(seen[i, 0]) // CELL
        start[cells[i] + 1] += 1
    start = np.cumsum(start)
    filled, features = start.copy(), np.empty(len(seen), np.int64)
    for i in range(len(seen)):
        features[filled[cells[i]]] = i
        filled[cells[i]] += 1
    return start, features
