"""Words of descriptors, and how alike two pictures are by them (Galvez-Lopez and Tardos 2012, sections III and IV)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.orb.vocabulary import Vocabulary
from taskslam.slam.vision.binary_words import Words, as_words, hamming

Ints = npt.NDArray[np.int64]
Bag = npt.NDArray[np.float32]
"""(W,) weights of all words in a picture, their sum 1; all zero of a picture without any."""

_GROUPED_LEVEL = 2  # below the root: features of different nodes there are not compared (ORB-SLAM: 4 above the words)


class _Tree(NamedTuple):
    """children: (N + 1,) node n has the nodes children[n] .. children[n + 1] - 1, node 0 being the root."""

    descriptors: Words
    children: Ints


class BagOfWords:
    """A vocabulary in the form in which it is asked."""

    def __init__(self, vocabulary: Vocabulary) -> None:
        parents = vocabulary.parent.astype(np.int64)
        nodes = len(parents)
        starts = np.searchsorted(parents, np.arange(nodes + 2)) + 1  # breadth-first: parents ascend
        self._tree = _Tree(as_words(vocabulary.descriptor), starts)
        leaves = np.flatnonzero(vocabulary.is_word)
        self._word_of_node = np.full(nodes + 1, -1, np.int64)
        self._word_of_node[leaves + 1] = np.arange(len(leaves))
        self._weights = vocabulary.weights()[leaves]

    def describe(self, descriptors: Words) -> tuple[Bag, Ints]:
        """The bag of (N, 4) descriptors, and their (N,) nodes at the level at which features are compared."""
        leaves, groups = _descend(self._tree, descriptors, _GROUPED_LEVEL)
        words = self._word_of_node[leaves]
        bag = np.bincount(words, minlength=len(self._weights)) * self._weights
        total = bag.sum()
        return (bag / total if total > 0.0 else bag).astype(np.float32), groups


@njit(cache=True)
def _descend(tree: _Tree, descriptors: Words, level: int) -> tuple[Ints, Ints]:
    n = len(descriptors)
    leaves, groups = np.empty(n, np.int64), np.empty(n, np.int64)
    for i in range(n):
        node, depth = 0, 0
        groups[i] = 0
        while tree.children[node] < tree.children[node + 1]:
            best, nearest = 257, -1
            for child in range(tree.children[node], tree.children[node + 1]):
                distance = hamming(descriptors, i, tree.descriptors, child - 1)
                if distance < best:
                    best, nearest = distance, child
            node, depth = nearest, depth + 1
            if depth <= level:
                groups[i] = node
        leaves[i] = node
    return leaves, groups


@njit(cache=True)
def likeness(bag: Bag, others: npt.NDArray[np.float32]) -> FloatArray:
    """(M,) of a bag with (M, W) others: 1 - |a - b| / 2, eq. (2), the sum of the smaller weights; 0 to 1."""
    scores = np.zeros(len(others))
    for m in range(len(others)):
        for w in range(len(bag)):
            scores[m] += min(bag[w], others[m, w])
    return scores
