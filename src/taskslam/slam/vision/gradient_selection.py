"""Where an image is worth tracking: in every cell of a grid the pixel of the largest gradient, if that is enough."""

from __future__ import annotations

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.pyramid import GreyImage

# Of pixels to the border: what surrounds a point is looked at, too.
_MARGIN = 4


def grid_shape(rows: int, columns: int, cell: int) -> tuple[int, int]:
    """Whole cells of `cell` pixels a side, down and across, of an image of so many rows and columns."""
    return rows // cell, columns // cell


@njit(cache=True)
def select_by_gradient(image: GreyImage, cell: int, least: float) -> tuple[FloatArray, int]:
    """At most one point a cell of `cell` pixels a side, in rows of cells.

    least: grey levels a pixel; the gradient is half the difference of a pixel's neighbours. Returns (N, 2) whole x, y
    in pixels of this image, and the number of cells that were asked.
    """
    rows, columns = image.shape
    down, across = rows // cell, columns // cell
    found = np.empty((down * across, 2))
    count = 0
    bound = 4.0 * least * least
    for i in range(down):
        for j in range(across):
            best, best_x, best_y = np.int32(-1), 0, 0
            for y in range(max(i * cell, _MARGIN), min((i + 1) * cell, rows - _MARGIN)):
                for x in range(max(j * cell, _MARGIN), min((j + 1) * cell, columns - _MARGIN)):
                    dx = np.int32(image[y, x + 1]) - np.int32(image[y, x - 1])
                    dy = np.int32(image[y + 1, x]) - np.int32(image[y - 1, x])
                    size = dx * dx + dy * dy
                    if size > best:
                        best, best_x, best_y = size, x, y
            if best >= bound and best >= 0:
                found[count, 0], found[count, 1] = best_x, best_y
                count += 1
    return found[:count].copy(), down * across


def adapt_threshold(least: float, share: float) -> float:
    """The gradient to ask for next time, so that 40 to 60 % of the cells have a point: within 2 to 32 grey levels."""
    if share < 0.4:
        return max(0.5 * least, 2.0)
    if share > 0.6:
        return min(2.0 * least, 32.0)
    return least
