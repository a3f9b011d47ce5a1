"""The look-up grid of correlative scan matching: how near each cell is to a hit of the reference scans.

A cell's value is 100 exp(-d^2 / (2 s^2)), d the distance to the nearest reference hit and s the smear deviation, up to
2 s (Olson 2009, section III-A; OpenKarto keeps it as bytes 0..100 and so do we).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray

Bytes = npt.NDArray[np.uint8]
FULL = 100
_SAME_PLACE = 97  # a hit on a cell this near to an earlier hit (2.5 cm at a smear of 10 cm) adds nothing worth its time


class CorrelationGrid:
    """One square grid, allocated once and filled anew for each set of reference scans."""

    def __init__(self, resolution: float, smear_deviation: float, reach: float) -> None:
        """Cells of `resolution` metres covering at least `reach` metres on all sides of the centre."""
        self.resolution = resolution
        self.kernel = _kernel(resolution, smear_deviation)
        half = math.ceil(reach / resolution) + self.kernel.shape[0] // 2 + 2
        self.values = np.zeros((2 * half, 2 * half), np.uint8)
        self.origin = np.zeros(2)

    def fill(self, points: FloatArray, centre: FloatArray) -> None:
        """Show the hits (N, 2), world frame, on a grid centred at (2,) `centre`; hits beyond its reach are left out."""
        half = self.values.shape[0] // 2
        # The origin is a whole number of cells, so that the same hits fall into the same cells wherever the centre is.
        self.origin = (np.round(centre / self.resolution) - half) * self.resolution
        self.values[:] = 0
        _smear(self.values, points, self.origin, self.resolution, self.kernel, _SAME_PLACE)


def _kernel(resolution: float, deviation: float) -> Bytes:
    half = round(2.0 * deviation / resolution)
    offsets = np.arange(-half, half + 1) * resolution
    squared = offsets[:, None] ** 2 + offsets[None, :] ** 2
    value = np.round(FULL * np.exp(-0.5 * squared / deviation**2))
    value[squared > (2.0 * deviation) ** 2 + 1e-9] = 0
    return value.astype(np.uint8)


@njit(cache=True)
def _smear(
    grid: Bytes, points: FloatArray, origin: FloatArray, resolution: float, kernel: Bytes, same_place: int
) -> None:
    size = kernel.shape[0]
    half = size // 2
    for p in range(points.shape[0]):
        ix = int(np.floor((points[p, 0] - origin[0]) / resolution))
        iy = int(np.floor((points[p, 1] - origin[1]) / resolution))
        if ix < half or iy < half or ix >= grid.shape[1] - half or iy >= grid.shape[0] - half:
            continue
        if grid[iy, ix] >= same_place:
            continue
        for row in range(size):
            target = grid[iy - half + row, ix - half : ix + half + 1]
            source = kernel[row]
            for column in range(size):
                if source[column] > target[column]:
                    target[column] = source[column]
