"""Words of descriptors, against looking at every node of the shipped tree in Python."""

import numpy as np
import pytest

from taskslam.slam.orb.bag_of_words import BagOfWords, likeness
from taskslam.slam.orb.vocabulary import shipped_vocabulary
from taskslam.slam.vision.binary_words import as_words


@pytest.fixture(scope="module")
def vocabulary():
    return shipped_vocabulary()


@pytest.fixture(scope="module")
def descriptors():
    return np.random.default_rng(3).integers(0, 256, (50, 32)).astype(np.uint8)


def path_of(vocabulary, descriptor):
    """Rows of the nodes on the way down to the word of a descriptor."""
    node, path = 0, []
    while True:
        children = np.flatnonzero(vocabulary.parent == node)
        if not len(children):
            return path
        distances = np.unpackbits(vocabulary.descriptor[children] ^ descriptor, axis=1).sum(axis=1)
        path.append(int(children[np.argmin(distances)]))
        node = path[-1] + 1


def test_words_are_found_as_by_looking_at_all(vocabulary, descriptors):
    bag, groups = BagOfWords(vocabulary).describe(as_words(descriptors))
    paths = [path_of(vocabulary, descriptor) for descriptor in descriptors]
    assert groups.tolist() == [path[min(1, len(path) - 1)] + 1 for path in paths]
    leaves = np.flatnonzero(vocabulary.is_word).tolist()
    expected = np.zeros(len(leaves))
    for path in paths:
        expected[leaves.index(path[-1])] += vocabulary.weights()[path[-1]]
    np.testing.assert_allclose(bag, expected / expected.sum(), atol=1e-6)


def test_a_picture_is_most_like_itself(vocabulary, descriptors):
    words = BagOfWords(vocabulary)
    bags = np.stack([words.describe(as_words(part))[0] for part in (descriptors, descriptors[:25], descriptors[25:])])
    scores = likeness(bags[0], bags)
    assert scores[0] == pytest.approx(1.0, abs=1e-6)
    np.testing.assert_allclose(scores, 1.0 - 0.5 * np.abs(bags - bags[0]).sum(axis=1), atol=1e-5)
    assert likeness(bags[1], bags)[2] < 0.5


def test_nothing_seen_is_like_nothing(vocabulary, descriptors):
    words = BagOfWords(vocabulary)
    empty, groups = words.describe(np.empty((0, 4), np.uint64))
    assert len(groups) == 0
    assert likeness(empty, words.describe(as_words(descriptors))[0][None]).tolist() == [0.0]
