"""Training a vocabulary: binary descriptors are split into clusters, and those again, until they are small.

Clusters are found by k-majority (Grana et al., "A fast approach for integrating ORB descriptors in the bag of words
model", 2013): as k-means, with the Hamming distance, and the bitwise majority as the centre. First centres are drawn as
in k-means++ (Arthur and Vassilvitskii 2007), which DBoW2 uses, too. All sums are of whole numbers below 2^24, exact in
float32, so the same descriptors and seed give the same tree on any machine.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from taskslam.slam.orb.vocabulary import DEPTH, DESCRIPTOR_BYTES, Bytes, Vocabulary

_ITERATIONS = 12
_BITS = 8 * DESCRIPTOR_BYTES
_CHUNK = 65536
Signs = npt.NDArray[np.float32]


def train(images: Sequence[Bytes], seed: int, branches: int = 10, depth: int = DEPTH, smallest: int = 40) -> Vocabulary:
    """A tree over the descriptors of training images, each (M, 32) uint8.

    smallest: a cluster of fewer descriptors is not split any further. Words that occur in no training image do not
    exist, because every word is the centre of descriptors.

    Raises:
        ValueError: there are no descriptors.
    """
    descriptors = np.concatenate([*images, np.zeros((0, DESCRIPTOR_BYTES), np.uint8)])
    if len(descriptors) == 0:
        raise ValueError("no descriptors to train a vocabulary from")
    image_of = np.repeat(np.arange(len(images)), [len(image) for image in images])
    rng = np.random.default_rng(seed)
    parents: list[int] = []
    centres: list[Bytes] = []
    images_with: list[int] = []
    level = [(0, np.arange(len(descriptors)))]
    for _ in range(depth):
        below: list[tuple[int, npt.NDArray[np.int64]]] = []
        for node, members in level:
            if node != 0 and len(members) < smallest:
                continue
            for centre, chosen in _split(descriptors[members], branches, rng):
                parents.append(node)
                centres.append(centre)
                images_with.append(len(np.unique(image_of[members[chosen]])))
                below.append((len(parents), members[chosen]))
        level = below
    return Vocabulary(
        branches,
        depth,
        np.array(parents, np.int32),
        np.array(centres, np.uint8).reshape(-1, DESCRIPTOR_BYTES),
        np.array(images_with, np.int32),
        len(images),
    )


def _split(descriptors: Bytes, branches: int, rng: np.random.Generator) -> list[tuple[Bytes, npt.NDArray[np.int64]]]:
    """At most `branches` clusters that are not empty: (32,) centre and (n,) rows of each."""
    signs = _signs(descriptors)
    centres = _first_centres(signs, branches, rng)
    belongs = _nearest(signs, centres)
    for _ in range(_ITERATIONS):
        for k in range(len(centres)):
            if (belongs == k).any():
                # A bit that half of the members have is set.
                centres[k] = np.where(signs[belongs == k].sum(axis=0) >= 0.0, 1.0, -1.0)
        again = _nearest(signs, centres)
        if (again == belongs).all():
            break
        belongs = again
    clusters = [(k, np.flatnonzero(belongs == k)) for k in range(len(centres))]
    return [(np.packbits(centres[k] > 0.0), rows) for k, rows in clusters if len(rows)]


def _first_centres(signs: Signs, branches: int, rng: np.random.Generator) -> Signs:
    """Each next one is drawn with a probability in proportion to its squared distance from the nearest before it."""
    chosen = [int(rng.integers(len(signs)))]
    nearest = _distance(signs, signs[chosen[0]])
    while len(chosen) < branches and nearest.any():
        edges = np.cumsum(nearest.astype(np.float64) ** 2)
        chosen.append(int(np.searchsorted(edges, rng.random() * edges[-1], side="right")))
        nearest = np.minimum(nearest, _distance(signs, signs[chosen[-1]]))
    return signs[chosen]


def _signs(descriptors: Bytes) -> Signs:
    """(N, 256) bits as -1 and 1, so that a product of rows tells their Hamming distance."""
    return np.unpackbits(descriptors, axis=1).astype(np.float32) * np.float32(2.0) - np.float32(1.0)


def _distance(signs: Signs, centre: Signs) -> Signs:
    distance: Signs = (_BITS - signs @ centre) / np.float32(2.0)
    return distance


def _nearest(signs: Signs, centres: Signs) -> npt.NDArray[np.int64]:
    """(N,) nearest centre of each; the first among equals."""
    return np.concatenate(
        [np.argmax(signs[at : at + _CHUNK] @ centres.T, axis=1) for at in range(0, len(signs), _CHUNK)]
    )
