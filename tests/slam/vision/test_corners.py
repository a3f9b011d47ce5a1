"""The segment test against OpenCV's FAST, and the score against its smaller eigenvalue."""

import numpy as np
import pytest

from taskslam.slam.vision.corners import corners_in_cells, is_corner, shi_tomasi

cv2 = pytest.importorskip("cv2")


@pytest.fixture
def image():
    noise = np.random.default_rng(0).integers(0, 256, (16, 20), dtype=np.uint8)
    return cv2.resize(noise, (120, 96), interpolation=cv2.INTER_NEAREST)


@pytest.mark.parametrize("threshold", [5, 20, 60])
def test_the_corners_are_opencvs(image, threshold):
    detector = cv2.FastFeatureDetector_create(threshold, False, cv2.FAST_FEATURE_DETECTOR_TYPE_9_16)
    expected = {tuple(map(int, corner.pt)) for corner in detector.detect(image)}
    found = {(x, y) for y in range(3, 93) for x in range(3, 117) if is_corner(image, x, y, threshold)}
    assert found == expected
    assert len(found) > 50


def test_the_score_is_the_smaller_eigenvalue_of_the_gradients(image):
    dy, dx = np.gradient(image.astype(float))
    for x, y in ((30, 40), (57, 21), (80, 70)):
        gx, gy = (each[y - 4 : y + 4, x - 4 : x + 4].ravel() for each in (dx, dy))
        tensor = np.array([[gx @ gx, gx @ gy], [gx @ gy, gy @ gy]]) / 64
        assert shi_tomasi(image, x, y) == pytest.approx(np.linalg.eigvalsh(tensor)[0])


def test_a_cell_has_one_corner_and_that_is_its_best(image):
    found = corners_in_cells(image, 24, 20, 1.0)
    cells = [(int(x) // 24, int(y) // 24) for x, y, _ in found]
    assert len(set(cells)) == len(cells) > 10
    for (i, j), (_, _, score) in zip(cells, found, strict=True):
        others = [
            shi_tomasi(image, x, y)
            for y in range(max(24 * j, 6), min(24 * j + 24, 90))
            for x in range(max(24 * i, 6), min(24 * i + 24, 114))
            if is_corner(image, x, y, 20)
        ]
        assert score == max(others)
