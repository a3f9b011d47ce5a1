"""FAST corners: Rosten and Drummond 2006, the segment test with nine of sixteen pixels on a circle of radius three.

In every cell of a grid the corner with the largest Shi-Tomasi score is kept (Forster et al. 2017).
"""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.pyramid import GreyImage

_RING_X = (0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1)
_RING_Y = (-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3)
_ARC = 9
_HALF = 4  # of the window of the score
_MARGIN = 6


@njit(cache=True)
def is_corner(image: GreyImage, x: int, y: int, threshold: int) -> bool:
    """Whether nine pixels in a row on the circle are all brighter, or all darker, than the middle by the threshold."""
    middle = int(image[y, x])
    for sign in (1, -1):
        bound = sign * middle + threshold
        # Of nine in a row at least two of the four at the compass points are seen.
        compass = 0
        for k in range(0, 16, 4):
            if sign * int(image[y + _RING_Y[k], x + _RING_X[k]]) > bound:
                compass += 1
        if compass < 2:
            continue
        run = 0
        for k in range(16 + _ARC - 1):
            if sign * int(image[y + _RING_Y[k % 16], x + _RING_X[k % 16]]) > bound:
                run += 1
                if run == _ARC:
                    return True
            else:
                run = 0
    return False


@njit(cache=True)
def shi_tomasi(image: GreyImage, x: int, y: int) -> float:
    """Smaller eigenvalue of the mean gradient tensor over 8 x 8 pixels (Shi and Tomasi 1994), squared grey levels."""
    xx, xy, yy = 0, 0, 0
    for j in range(y - _HALF, y + _HALF):
        for i in range(x - _HALF, x + _HALF):
            dx = int(image[j, i + 1]) - int(image[j, i - 1])
            dy = int(image[j + 1, i]) - int(image[j - 1, i])
            xx += dx * dx
            xy += dx * dy
            yy += dy * dy
    n = 4.0 * (2 * _HALF) ** 2
    half_trace, difference = 0.5 * (xx + yy) / n, 0.5 * (xx - yy) / n
    return half_trace - math.sqrt(difference * difference + (xy / n) ** 2)


@njit(cache=True)
def corners_in_cells(image: GreyImage, cell: int, threshold: int, least: float) -> FloatArray:
    """(N, 3) x, y and score of the best corner of every cell of `cell` pixels a side, if its score is at least so."""
    rows, columns = image.shape
    down, across = rows // cell, columns // cell
    found = np.empty((down * across, 3))
    count = 0
    for i in range(down):
        for j in range(across):
            best, best_x, best_y = least, -1, -1
            for y in range(max(i * cell, _MARGIN), min((i + 1) * cell, rows - _MARGIN)):
                for x in range(max(j * cell, _MARGIN), min((j + 1) * cell, columns - _MARGIN)):
                    if is_corner(image, x, y, threshold):
                        score = shi_tomasi(image, x, y)
                        if score > best:
                            best, best_x, best_y = score, x, y
            if best_x >= 0:
                found[count, 0], found[count, 1], found[count, 2] = best_x, best_y, best
                count += 1
    return found[:count].copy()
