"""New points of a keyframe: chosen by gradient, one a cell, with inverse depths by stereo or by what lies there."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray
from taskslam.slam.dsol.settings import DsolSettings
from taskslam.slam.vision.gradient_selection import adapt_threshold, select_by_gradient
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.pyramid import Pyramid
from taskslam.slam.vision.stereo_matching import match_stereo

MATCHED, GUESSED = 5, 4
"""Information of a point whose depth a match told, and of one whose depth its neighbour told; from MATCHED on it is
aligned with, below GUESSED it is left out for good (the authors' numbers)."""


class PointFinder:
    """Finds points; remembers the gradient that it asks for, which adapts to the scene."""

    def __init__(self, settings: DsolSettings, pinhole: Pinhole) -> None:
        self._settings, self._disparity_at_1m = settings, pinhole.f * pinhole.baseline
        self._gradient = settings.least_gradient

    def find(self, left: Pyramid, right: Pyramid) -> tuple[FloatArray, FloatArray]:
        """(N, 2) pixels of level 0, the corners of four, and (N,) inverse depths, 1/m, NaN where nothing matched."""
        s = self._settings
        chosen, cells = select_by_gradient(left[1], max(s.cell // 2, 1), self._gradient)
        self._gradient = adapt_threshold(self._gradient, len(chosen) / max(cells, 1))
        points = 2.0 * chosen + 0.5  # a pixel of level 1 is the mean of four of level 0
        largest = self._disparity_at_1m / s.min_depth
        inverse_depths = match_stereo(left, right, points, largest, s.least_correlation) / self._disparity_at_1m
        inverse_depths[~(inverse_depths >= 1.0 / s.max_depth)] = np.nan
        return points, inverse_depths


def cells_of(pixels: FloatArray, cell: int) -> npt.NDArray[np.int64]:
    """(N,) numbers of the cells of `cell` pixels a side in which (N, 2) pixels lie."""
    column, row = np.floor((pixels + 0.5) / cell).astype(np.int64).T
    numbers: npt.NDArray[np.int64] = row * (1 << 20) + column
    return numbers


def fill_from_cells(
    points: FloatArray, inverse_depths: FloatArray, known: FloatArray, known_inverse_depths: FloatArray, cell: int
) -> FloatArray:
    """(N,) inverse depths with the unknown ones (NaN) taken from a known point in the same cell, where there is one."""
    cells, first = np.unique(cells_of(known, cell), return_index=True)
    filled = inverse_depths.copy()
    if not len(cells):
        return filled
    wanted = cells_of(points, cell)
    at = np.minimum(np.searchsorted(cells, wanted), len(cells) - 1)
    take = np.isnan(inverse_depths) & (cells[at] == wanted)
    filled[take] = known_inverse_depths[first[at[take]]]
    return filled
