"""Disparities of single points in a rectified pair, from coarse to fine.

A window about the point is compared by zero-mean normalised cross-correlation. All disparities are tried on the
coarsest level; every finer one asks the neighbours of twice that. The finest is refined by a parabola through three
correlations.
"""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.pyramid import GreyImage, Pyramid

_HALF_WIDTH, _HALF_HEIGHT = 3, 2  # 7 x 5 pixels
_FLAT = 35.0  # squared grey levels summed over a window: of less, a correlation says nothing


def match_stereo(
    left: Pyramid, right: Pyramid, points: FloatArray, largest: float, least_correlation: float
) -> FloatArray:
    """(N,) disparities in pixels of level 0 for (N, 2) points of the left image; NaN where none was found.

    largest: the largest disparity that is looked for, pixels of level 0. least_correlation: asked for on all levels but
    the coarsest.
    """
    coarsest = len(left) - 1
    disparities: FloatArray = _search(left[coarsest], right[coarsest], points, coarsest, largest)
    for level in range(coarsest - 1, -1, -1):
        disparities = _refine(left[level], right[level], points, level, disparities, least_correlation)
    return disparities


@njit(cache=True)
def _correlation(left: GreyImage, right: GreyImage, x: int, y: int, xr: int) -> float:
    """Of the windows about (x, y) and (xr, y), both wholly inside; -1 where one of them is flat."""
    n = (2 * _HALF_WIDTH + 1) * (2 * _HALF_HEIGHT + 1)
    sl, sr, sll, srr, slr = 0, 0, 0, 0, 0
    for i in range(-_HALF_HEIGHT, _HALF_HEIGHT + 1):
        for j in range(-_HALF_WIDTH, _HALF_WIDTH + 1):
            a, b = int(left[y + i, x + j]), int(right[y + i, xr + j])
            sl += a
            sr += b
            sll += a * a
            srr += b * b
            slr += a * b
    vl, vr = sll - sl * sl / n, srr - sr * sr / n
    if vl < _FLAT or vr < _FLAT:
        return -1.0
    return (slr - sl * sr / n) / math.sqrt(vl * vr)


@njit(cache=True)
def correlations(left: GreyImage, right: GreyImage, points: FloatArray, matches: FloatArray) -> FloatArray:
    """(N,) of the windows about (N, 2) pixels of the left image and their matches in the right, on the left's row.

    -1 where a window is flat or leaves its image.
    """
    rows, columns = left.shape
    found = np.full(points.shape[0], -1.0)
    for p in range(points.shape[0]):
        x, y = int(np.floor(points[p, 0] + 0.5)), int(np.floor(points[p, 1] + 0.5))
        xr = int(np.floor(matches[p, 0] + 0.5))
        if min(x, xr) < _HALF_WIDTH or max(x, xr) >= columns - _HALF_WIDTH:
            continue
        if _HALF_HEIGHT <= y < rows - _HALF_HEIGHT:
            found[p] = _correlation(left, right, x, y, xr)
    return found


@njit(cache=True)
def _search(left: GreyImage, right: GreyImage, points: FloatArray, level: int, largest: float) -> FloatArray:
    rows, columns = left.shape
    scale = 0.5**level
    found = np.full(points.shape[0], np.nan)
    for p in range(points.shape[0]):
        x, y = int(np.floor((points[p, 0] + 0.5) * scale)), int(np.floor((points[p, 1] + 0.5) * scale))
        x = min(max(x, _HALF_WIDTH), columns - 1 - _HALF_WIDTH)
        y = min(max(y, _HALF_HEIGHT), rows - 1 - _HALF_HEIGHT)
        best, best_d = -1.0, -1
        for d in range(min(int(np.ceil(largest * scale)), x - _HALF_WIDTH) + 1):
            c = _correlation(left, right, x, y, x - d)
            if c > best:
                best, best_d = c, d
        if best_d >= 0:
            found[p] = best_d / scale
    return found


@njit(cache=True)
def _refine(
    left: GreyImage, right: GreyImage, points: FloatArray, level: int, guess: FloatArray, least: float
) -> FloatArray:
    rows, columns = left.shape
    scale = 0.5**level
    found = np.full(points.shape[0], np.nan)
    for p in range(points.shape[0]):
        if np.isnan(guess[p]):
            continue
        x, y = int(np.floor((points[p, 0] + 0.5) * scale)), int(np.floor((points[p, 1] + 0.5) * scale))
        if x < _HALF_WIDTH or y < _HALF_HEIGHT or x >= columns - _HALF_WIDTH or y >= rows - _HALF_HEIGHT:
            if level == 0:
                continue
            x = min(max(x, _HALF_WIDTH), columns - 1 - _HALF_WIDTH)
            y = min(max(y, _HALF_HEIGHT), rows - 1 - _HALF_HEIGHT)
        middle = int(np.round(guess[p] * scale))
        best, best_d = -1.0, -1
        for d in range(max(middle - 1, 0), middle + 2):
            if x - d < _HALF_WIDTH:
                break
            c = _correlation(left, right, x, y, x - d)
            if c > best:
                best, best_d = c, d
        if best < least or best_d < 0:
            continue
        shift = 0.0
        if level == 0 and best_d > 0 and x - best_d - 1 >= _HALF_WIDTH:
            before = _correlation(left, right, x, y, x - best_d + 1)
            after = _correlation(left, right, x, y, x - best_d - 1)
            bend = before - 2.0 * best + after
            if before > -1.0 and after > -1.0 and bend < 0.0:
                shift = min(max(0.5 * (before - after) / bend, -0.5), 0.5)
        found[p] = (best_d + shift) / scale
    return found
