"""ORB features (Rublee et al. 2011, by OpenCV), spread over the picture.

Of all corners the strongest of every cell are kept first, then the second strongest, until there are enough: features
crowded together say the same thing (ORB-SLAM's quadtree has the same aim).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.binary_words import Words, as_words
from taskslam.slam.vision.pyramid import GreyImage

Ints = npt.NDArray[np.int64]
_CROWD = 10  # corners that are looked at for each that is kept, at most
_CELL = 32  # pixels
_EDGE = 19  # pixels: half of ORB's patch of 31, and room to turn it


class Features(NamedTuple):
    """pixels: (N, 2) u, v; octaves: (N,) levels of the pyramid, 0 the finest; descriptors: (N, 4)."""

    pixels: FloatArray
    octaves: Ints
    descriptors: Words


class OrbExtractor:
    """Finds at most `count` features with FAST at a threshold, or where few are found at the lower one."""

    def __init__(self, count: int, scale: float, levels: int, threshold: int, lowest_threshold: int) -> None:
        import cv2  # not a dependency of the core

        cv2.setNumThreads(1)
        self._count, self._scale = count, scale
        self._detectors: list[Any] = [
            cv2.ORB.create(
                nfeatures=_CROWD * count, scaleFactor=scale, nlevels=levels, edgeThreshold=_EDGE, fastThreshold=at
            )
            for at in (threshold, lowest_threshold)
        ]

    def find(self, image: GreyImage) -> Features:
        """The features of an (H, W) image, in an order that only depends on it."""
        features = self._find(self._detectors[0], image)
        if len(features.pixels) < self._count // 2:
            return self._find(self._detectors[1], image)
        return features

    def _find(self, detector: Any, image: GreyImage) -> Features:
        corners = detector.detect(image, None)
        strengths = np.array([corner.response for corner in corners])
        chosen = spread(_pixels(corners), strengths, self._count, _CELL, image.shape[1] // _CELL + 1)
        kept, descriptors = detector.compute(image, [corners[i] for i in chosen])
        if descriptors is None:
            return Features(np.empty((0, 2)), np.empty(0, np.int64), np.empty((0, 4), np.uint64))
        octaves = np.array([corner.octave for corner in kept])
        return Features(self._centred(_pixels(kept), octaves), octaves, as_words(descriptors))

    def _centred(self, pixels: FloatArray, octaves: Ints) -> FloatArray:
        """OpenCV scales whole coordinates of a coarse level; it is its pixels' corners that were scaled."""
        centred: FloatArray = pixels + 0.5 * (self._scale**octaves - 1.0)[:, None]
        return centred


def _pixels(corners: Any) -> FloatArray:
    """(N, 2) u, v of OpenCV's key points."""
    import cv2

    return np.asarray(cv2.KeyPoint.convert(corners), np.float64).reshape(-1, 2)


def spread(pixels: FloatArray, strengths: FloatArray, count: int, cell: int, columns: int) -> Ints:
    """(M,) rows of at most `count` of (N, 2) pixels: by rank within their cell, then by (N,) strength; ascending."""
    if len(pixels) <= count:
        return np.arange(len(pixels))
    order = np.argsort(-strengths, kind="stable")
    places = (pixels // cell).astype(np.int64)
    ranks = _ranks(order, places[:, 1] * columns + places[:, 0])
    chosen: Ints = np.sort(order[np.argsort(ranks[order], kind="stable")[:count]])
    return chosen


@njit(cache=True)
def _ranks(order: Ints, cells: Ints) -> Ints:
    """(N,) how many of the same cell come before each in `order`."""
    met = np.zeros(cells.max() + 1, np.int64)
    ranks = np.empty(len(order), np.int64)
    for i in order:
        ranks[i] = met[cells[i]]
        met[cells[i]] += 1
    return ranks
