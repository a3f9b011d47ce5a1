import numpy as np
import pytest

from taskslam.slam.orb.vocabulary_training import train

RNG = np.random.default_rng(3)
PLACES = RNG.integers(0, 256, (12, 32), dtype=np.uint8)


def seen(place, count, flips=6):
    """Descriptors of one corner, each with some bits flipped."""
    bits = np.unpackbits(np.tile(place, (count, 1)), axis=1)
    for row in bits:
        row[RNG.choice(256, flips, replace=False)] ^= 1
    return np.packbits(bits, axis=1)


IMAGES = [np.concatenate([seen(PLACES[(k + j) % 12], 15) for j in range(4)]) for k in range(12)]


def word_of(vocabulary, descriptor):
    """The word that DBoW2 finds: the nearest child, level by level."""
    node = 0
    while len(children := np.flatnonzero(vocabulary.parent == node)):
        bits = np.unpackbits(vocabulary.descriptor[children] ^ descriptor, axis=1).sum(axis=1)
        node = int(children[np.argmin(bits)]) + 1
    return node


def test_looks_of_one_corner_become_one_word_and_those_of_others_do_not():
    vocabulary = train(IMAGES, seed=1, branches=12, depth=1)
    words = [{word_of(vocabulary, d) for d in seen(place, 10)} for place in PLACES]
    assert all(len(found) == 1 for found in words)
    assert len(set().union(*words)) == 12


def test_a_words_weight_counts_the_images_that_have_it():
    vocabulary = train(IMAGES, seed=0, branches=4, smallest=100)
    for node in np.flatnonzero(vocabulary.is_word):
        holders = sum(any(word_of(vocabulary, d) == node + 1 for d in image) for image in IMAGES)
        assert vocabulary.images_with[node] == holders


def test_no_node_has_more_children_than_branches_and_no_path_is_longer_than_depth():
    vocabulary = train(IMAGES, seed=0, branches=3, depth=2, smallest=2)
    assert np.bincount(vocabulary.parent).max() <= 3
    grandparents = vocabulary.parent[vocabulary.parent[vocabulary.parent > 0] - 1]
    assert (grandparents == 0).all()


def test_the_same_seed_gives_the_same_tree():
    first, second, other = (train(IMAGES, seed, branches=4) for seed in (5, 5, 6))
    assert first.descriptor.tobytes() == second.descriptor.tobytes()
    assert first.descriptor.tobytes() != other.descriptor.tobytes()


def test_equal_descriptors_cannot_be_split_further():
    vocabulary = train([np.tile(PLACES[:1], (200, 1))], seed=0)
    assert len(np.unique(vocabulary.descriptor, axis=0)) == 1
    assert (np.bincount(vocabulary.parent) <= 1).all()


def test_nothing_to_learn_from_is_said():
    with pytest.raises(ValueError, match="no descriptors"):
        train([], seed=0)
