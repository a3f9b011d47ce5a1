"""`Places`: which keyframes look like a picture, and which of their points it shows."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.slam.orb.bag_of_words import Bag, BagOfWords, likeness
from taskslam.slam.orb.vocabulary import shipped_vocabulary
from taskslam.slam.vision.binary_words import Words, hamming

Ints = npt.NDArray[np.int64]


class Places:
    """Bags of words of keyframes, by their rows in the map."""

    def __init__(self) -> None:
        self.words = BagOfWords(shipped_vocabulary())
        self._bags = np.empty((0, 0), np.float32)

    def keep(self, k: int, bag: Bag) -> None:
        """Remember keyframe k."""
        if k >= len(self._bags):
            larger = np.zeros((max(64, 2 * len(self._bags), k + 1), len(bag)), np.float32)
            larger[: len(self._bags), : self._bags.shape[1]] = self._bags
            self._bags = larger
        self._bags[k] = bag

    def scores(self, bag: Bag, keyframes: Ints) -> npt.NDArray[np.float64]:
        """(M,) how alike these keyframes are to a bag, 0 to 1."""
        scores: npt.NDArray[np.float64] = likeness(bag, self._bags[keyframes])
        return scores

    def bag(self, k: int) -> Bag:
        """Of a keyframe."""
        bag: Bag = self._bags[k]
        return bag


@njit(cache=True)
def match_by_words(
    descriptors: Words, groups: Ints, others: Words, other_groups: Ints, most: int, ratio: float
) -> Ints:
    """(N,) for each descriptor the one of the others in its node of the vocabulary that is most like it, or -1.

    most: bits by which they may differ; ratio: by less than so much of the second best. No other is matched twice.
    """
    n, m = len(descriptors), len(others)
    found, distances = np.full(n, -1, np.int64), np.full(m, 257, np.int64)
    owner = np.full(m, -1, np.int64)
    for i in range(n):
        best, second, at = 257, 257, -1
        for j in range(m):
            if groups[i] != other_groups[j]:
                continue
            distance = hamming(descriptors, i, others, j)
            if distance < best:
                best, second, at = distance, best, j
            elif distance < second:
                second = distance
        if at < 0 or best > most or best >= ratio * second or best >= distances[at]:
            continue
        if owner[at] >= 0:
            found[owner[at]] = -1
        owner[at], distances[at], found[i] = i, best, at
    return found
