"""Pyramids against OpenCV's filters, which are an independent implementation."""

import numpy as np
import pytest

from taskslam.robot import load_robot
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.pyramid import bilinear, blur, build_pyramid, grey, halve

cv2 = pytest.importorskip("cv2")


@pytest.fixture
def image():
    return np.random.default_rng(0).integers(0, 256, (61, 94), dtype=np.uint8)


def test_blur_is_opencvs_gaussian_of_three_pixels(image):
    np.testing.assert_array_equal(blur(image), cv2.GaussianBlur(image, (3, 3), 0, borderType=cv2.BORDER_REPLICATE))


def test_halving_is_opencvs_mean_over_areas(image):
    even = image[:60]
    np.testing.assert_array_equal(halve(even), cv2.resize(even, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA))


def test_an_odd_row_is_left_out(image):
    assert [level.shape for level in build_pyramid(image, 3)] == [(61, 94), (30, 47), (15, 23)]


def test_between_pixels_the_level_is_opencvs(image):
    points = np.random.default_rng(1).uniform((0, 0), (92.9, 59.9), (50, 2)).astype(np.float32)
    expected = cv2.remap(image.astype(np.float32), points[:, None, 0], points[:, None, 1], cv2.INTER_LINEAR)
    found = [bilinear(image, float(x), float(y)) for x, y in points]
    np.testing.assert_allclose(found, expected[:, 0], atol=5.0)  # OpenCV looks up thirty-seconds of a pixel
    assert bilinear(np.array([[0, 100], [0, 100]], np.uint8), 0.25, 0.5) == 25.0


def test_colours_become_opencvs_grey(image):
    color = np.random.default_rng(2).integers(0, 256, (20, 30, 3), dtype=np.uint8)
    np.testing.assert_array_equal(grey(color), cv2.cvtColor(color, cv2.COLOR_RGB2GRAY))


def test_a_point_is_at_the_scaled_place_on_every_level():
    """A square of 8 x 8 pixels about (11.5, 19.5) is one pixel of level 3, and there the pinhole has it."""
    image = np.zeros((64, 64), np.uint8)
    image[16:24, 8:16] = 200
    level = halve(halve(halve(image)))
    y, x = np.unravel_index(level.argmax(), level.shape)
    fine, coarse = (Pinhole(50.0, 32.0, 32.0, 0.1).at_level(n) for n in (0, 3))
    center = (11.5 - fine.cx) / fine.f, (19.5 - fine.cy) / fine.f
    assert (coarse.f * center[0] + coarse.cx, coarse.f * center[1] + coarse.cy) == (x, y)


def test_the_pinhole_is_that_of_the_data_sheet():
    camera = load_robot("turtlebot2").rig.stereo
    pinhole = Pinhole.of(camera)
    assert pinhole == (camera.focal_length, 376.0, 240.0, 0.11)
