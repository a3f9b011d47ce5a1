import numpy as np
import pytest

from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.fully_visible import border_margin, needed_margin, why_cut

CAMERA = Camera.pinhole("wide", 1280, 720, 800.0)


def square(left: float, top: float, side: float) -> np.ndarray:
    return np.array([[left, top], [left + side, top], [left + side, top + side], [left, top + side]])


@pytest.mark.parametrize(
    ("corners", "margin"),
    [
        (square(10, 300, 80), 10.5),
        (square(600, 3, 80), 3.5),
        (square(1190, 300, 80), 9.5),
        (square(600, 633, 80), 6.5),
        (square(-4, 300, 80), -3.5),
    ],
)
def test_the_margin_is_counted_from_the_edge_of_the_outermost_pixels(corners, margin):
    assert border_margin(corners, CAMERA) == pytest.approx(margin)


def test_a_cell_of_white_must_be_in_view_or_five_pixels():
    assert needed_margin(square(0, 0, 80), "tag36h11") == 10
    assert needed_margin(square(0, 0, 20), "tag36h11") == 5


@pytest.mark.parametrize(("left", "whole"), [(9.6, True), (9.4, False), (3.0, False), (-2.0, False)])
def test_a_tag_nearer_to_the_border_than_its_cell_is_cut(left, whole):
    reason = why_cut(square(left, 300, 80), CAMERA, "tag36h11")
    assert (reason is None) == whole
    if reason:
        assert "10.0 px needed" in reason
