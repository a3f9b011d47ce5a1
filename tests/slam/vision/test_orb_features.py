"""ORB features, spread over the picture, and the distance of their descriptors."""

import numpy as np
import pytest

from taskslam.slam.vision.binary_words import as_words, hamming
from taskslam.slam.vision.orb_features import OrbExtractor, spread

cv2 = pytest.importorskip("cv2")


def test_hamming_counts_the_bits_that_differ():
    random = np.random.default_rng(0)
    a, b = (random.integers(0, 256, (20, 32)).astype(np.uint8) for _ in range(2))
    expected = np.unpackbits(a ^ b, axis=1).sum(axis=1)
    assert [hamming(as_words(a), i, as_words(b), i) for i in range(20)] == expected.tolist()
    full = np.full((1, 32), 255, np.uint8)
    assert hamming(as_words(full), 0, as_words(0 * full), 0) == 256


def test_the_strongest_of_every_cell_comes_first():
    crowd = np.column_stack((np.linspace(1, 31, 50), np.full(50, 5.0)))
    alone = np.array([[100.0, 5.0], [100.0, 70.0]])
    strengths = np.concatenate((np.arange(50.0) + 10.0, [0.1, 0.2]))
    chosen = spread(np.concatenate((crowd, alone)), strengths, 5, 32, 5)
    assert chosen.tolist() == [47, 48, 49, 50, 51]


def test_of_few_all_are_kept():
    assert spread(np.ones((3, 2)), np.ones(3), 5, 32, 5).tolist() == [0, 1, 2]


@pytest.fixture
def picture():
    """Tiles on the left, strong ones; weak ones on the right."""
    random = np.random.default_rng(1)
    tiles = random.integers(0, 256, (30, 40)).astype(float)
    tiles[:, 20:] = 128 + 0.3 * (tiles[:, 20:] - 128)
    return np.kron(tiles, np.ones((8, 8))).astype(np.uint8)


def test_features_are_opencvs_and_reach_into_weak_texture(picture):
    features = OrbExtractor(200, 1.2, 8, 20, 7).find(picture)
    assert len(features.pixels) == 200
    keypoints, descriptors = cv2.ORB.create(2000, 1.2, 8, 19, fastThreshold=20).detectAndCompute(picture, None)
    known = {}
    for point, row in zip(keypoints, descriptors, strict=True):
        half = 0.5 * (1.2**point.octave - 1.0)
        known[point.pt[0] + half, point.pt[1] + half, point.octave] = row.tobytes()
    for pixel, octave, words in zip(
        features.pixels.tolist(), features.octaves.tolist(), features.descriptors, strict=True
    ):
        assert known[(*pixel, octave)] == words.tobytes()
    crowded = cv2.ORB.create(200, 1.2, 8, 19, fastThreshold=20).detect(picture, None)
    right, of_opencv = (features.pixels[:, 0] > 160).sum(), sum(point.pt[0] > 160 for point in crowded)
    assert right > 30 > 5 * of_opencv


def test_where_little_is_found_the_lower_threshold_is_tried(picture):
    weak = (128 + 0.1 * (picture.astype(float) - 128)).astype(np.uint8)
    high, both = OrbExtractor(200, 1.2, 8, 40, 40).find(weak), OrbExtractor(200, 1.2, 8, 40, 5).find(weak)
    assert len(high.pixels) < len(both.pixels)


def test_a_blank_picture_has_no_features():
    features = OrbExtractor(200, 1.2, 8, 20, 7).find(np.full((240, 320), 90, np.uint8))
    assert features.pixels.shape == (0, 2)
    assert features.descriptors.shape == (0, 4)
