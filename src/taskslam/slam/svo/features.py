"""New features of a keyframe: corners of several levels, and edgelets where there is no corner, one a free cell."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray
from taskslam.slam.svo.settings import SvoSettings
from taskslam.slam.vision.corners import corners_in_cells
from taskslam.slam.vision.gradient_selection import select_by_gradient
from taskslam.slam.vision.pyramid import GreyImage, Pyramid

_LEAST_ACROSS = 0.8  # of an edgelet's normal along the rows: of others, the two cameras do not tell the depth


class Features(NamedTuple):
    """pixels: (N, 2) of level 0; levels: (N,) where each was found; normals: (N, 2) of edgelets, zeros for corners."""

    pixels: FloatArray
    levels: npt.NDArray[np.int64]
    normals: FloatArray


def find_features(left: Pyramid, settings: SvoSettings, taken: FloatArray) -> Features:
    """Of every cell in which none of the (M, 2) pixels `taken` lies: its best corner, or else its best edgelet."""
    s = settings
    best: dict[int, tuple[float, float, float, int]] = {}
    busy = set(_cells(taken, s.cell).tolist())
    for level in range(s.corner_levels):
        scale = 2.0**level
        corners = corners_in_cells(left[level], max(s.cell >> level, 4), s.fast_threshold, s.least_score)
        pixels = (corners[:, :2] + 0.5) * scale - 0.5
        for cell, (x, y), score in zip(_cells(pixels, s.cell).tolist(), pixels, corners[:, 2], strict=True):
            if cell not in busy and (cell not in best or score > best[cell][2]):
                best[cell] = (x, y, score, level)
    corners_found = np.array([(x, y, level) for x, y, _, level in best.values()]).reshape(-1, 3)
    edges, _ = select_by_gradient(left[0], s.cell, s.edgelet_gradient**0.5)
    free = np.array([cell not in busy and cell not in best for cell in _cells(edges, s.cell).tolist()], bool)
    edges = edges[free]
    directions = _directions(left[0], edges)
    steep = np.abs(directions[:, 0]) > _LEAST_ACROSS
    edges, directions = edges[steep], directions[steep]
    pixels = np.concatenate([corners_found[:, :2], edges])
    levels = np.concatenate([corners_found[:, 2], np.zeros(len(edges))]).astype(np.int64)
    normals = np.concatenate([np.zeros((len(corners_found), 2)), directions])
    return Features(pixels, levels, normals)


def _cells(pixels: FloatArray, cell: int) -> npt.NDArray[np.int64]:
    column, row = np.floor((pixels + 0.5) / cell).astype(np.int64).T
    numbers: npt.NDArray[np.int64] = row * (1 << 20) + column
    return numbers


def _directions(image: GreyImage, points: FloatArray) -> FloatArray:
    """(N, 2) unit gradients at (N, 2) whole pixels."""
    x, y = points.astype(np.int64).T
    grey = image.astype(np.float64)
    gradients = np.stack([grey[y, x + 1] - grey[y, x - 1], grey[y + 1, x] - grey[y - 1, x]], axis=1)
    directions: FloatArray = gradients / np.linalg.norm(gradients, axis=1, keepdims=True)
    return directions
