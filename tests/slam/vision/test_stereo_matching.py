import numpy as np
import pytest

from taskslam.slam.vision.pyramid import build_pyramid
from taskslam.slam.vision.stereo_matching import match_stereo

cv2 = pytest.importorskip("cv2")


def textured(rows=160, columns=320, seed=0):
    noise = np.random.default_rng(seed).integers(0, 256, (rows // 4, columns // 4), dtype=np.uint8)
    return cv2.resize(noise, (columns, rows), interpolation=cv2.INTER_CUBIC)


def shifted(image, disparity):
    """What a camera to the right sees of a fronto-parallel wall."""
    matrix = np.float32([[1, 0, -disparity], [0, 1, 0]])
    return cv2.warpAffine(image, matrix, image.shape[::-1], flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)


@pytest.fixture
def points():
    return np.stack(np.meshgrid(np.arange(120.5, 300, 11), np.arange(20.5, 140, 11)), -1).reshape(-1, 2)


@pytest.mark.parametrize("disparity", [0.0, 3.25, 17.5, 61.0])
def test_disparities_of_a_wall_to_a_quarter_of_a_pixel(points, disparity):
    left = textured()
    pair = build_pyramid(left, 4), build_pyramid(shifted(left, disparity), 4)
    found = match_stereo(*pair, points, 80.0, 0.8)
    known = np.isfinite(found)
    assert known.mean() > 0.9
    assert np.median(np.abs(found[known] - disparity)) < 0.25


def test_nothing_is_found_beyond_the_largest_disparity(points):
    left = textured()
    found = match_stereo(build_pyramid(left, 4), build_pyramid(shifted(left, 60.0), 4), points, 24.0, 0.8)
    assert np.isnan(found).mean() > 0.9


def test_pictures_that_have_nothing_in_common_do_not_match(points):
    pair = build_pyramid(textured(seed=1), 4), build_pyramid(textured(seed=2), 4)
    assert np.isnan(match_stereo(*pair, points, 80.0, 0.8)).mean() > 0.8


def test_a_flat_picture_has_no_disparity(points):
    flat = np.full((160, 320), 90, np.uint8)
    assert np.isnan(match_stereo(build_pyramid(flat, 4), build_pyramid(flat, 4), points, 80.0, 0.8)).all()


def test_swapped_pictures_match_by_chance_alone(points):
    left = textured()
    right = shifted(left, 17.5)
    found = match_stereo(build_pyramid(right, 4), build_pyramid(left, 4), points, 80.0, 0.8)
    assert np.isfinite(found).mean() < 0.25
