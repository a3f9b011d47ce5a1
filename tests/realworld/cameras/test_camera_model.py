from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.errors import CameraError
from taskslam.realworld.cameras.camera_model import Camera

K = np.array([[638.5, 0.0, 323.9], [0.0, 636.9, 229.7], [0.0, 0.0, 1.0]])
LENSES = {
    "none": ("plumb_bob", []),
    "pointgrey": ("plumb_bob", [-0.4222, 0.2251, 0.0008, 0.0025, 0.0]),
    "c930e": ("plumb_bob", [0.1122, -0.1556, 0.0031, -0.0009]),
    "wide": ("rational_polynomial", [0.5, 0.1, 0.001, 0.001, 0.01, 0.8, 0.2, 0.02]),
    "fisheye": ("equidistant", [0.01, -0.02, 0.003, -0.001]),
}


def camera(lens: str) -> Camera:
    model, distortion = LENSES[lens]
    return Camera(lens, 648, 488, K, np.array(distortion), model)  # type: ignore[arg-type]


@pytest.mark.parametrize("lens", LENSES)
def test_every_pixel_goes_to_a_ray_and_back(lens: str) -> None:
    u, v = np.meshgrid(np.linspace(-0.5, 647.5, 60), np.linspace(-0.5, 487.5, 40))
    pixels = np.column_stack([u.ravel(), v.ravel()])
    np.testing.assert_allclose(camera(lens).distort(camera(lens).undistort(pixels)), pixels, atol=1e-9)


@pytest.mark.parametrize("lens", LENSES)
def test_points_land_where_opencv_puts_them(lens: str) -> None:
    cv2 = pytest.importorskip("cv2")
    points = np.random.default_rng(0).uniform([-0.4, -0.3, 0.8], [0.4, 0.3, 2.0], (200, 3))
    ours, zero = camera(lens), np.zeros(3)
    if lens == "fisheye":
        theirs, _ = cv2.fisheye.projectPoints(points[:, None], zero, zero, ours.K, ours.distortion)
    else:
        theirs, _ = cv2.projectPoints(points, zero, zero, ours.K, ours.distortion)
    np.testing.assert_allclose(ours.project(points), theirs.reshape(-1, 2), atol=1e-9)


def test_the_middle_is_exact_and_no_point_is_fine() -> None:
    for lens in LENSES:
        np.testing.assert_allclose(camera(lens).undistort([[323.9, 229.7]]), [[0, 0]], atol=1e-12)
        assert camera(lens).undistort(np.empty((0, 2))).shape == (0, 2)


def test_what_is_behind_or_beyond_the_lens_is_nowhere() -> None:
    assert np.isnan(camera("none").project([[0.1, 0.1, -1.0], [0.1, 0.1, 0.0]])).all()
    # The c930e's polynomial folds back beyond a tangent of 1.17: such a point must not appear inside the image.
    assert np.isnan(camera("c930e").project([[2.0, 0.0, 1.0]])).all()


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=2), st.sampled_from(sorted(LENSES)))
def test_any_pixel_is_a_ray_that_returns_to_it_or_nothing(pixel: list[float], lens: str) -> None:
    ray = camera(lens).undistort([pixel])
    if np.isfinite(ray).all():
        np.testing.assert_allclose(camera(lens).distort(ray), [pixel], atol=1e-5, rtol=1e-9)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"K": np.zeros((3, 3))}, "singular"),
        ({"K": np.diag([np.nan, 500, 1])}, "singular"),
        ({"K": np.ones((3, 3))}, "upper triangular"),
        ({"width": 0}, "positive size"),
        ({"distortion": np.zeros(3)}, "3 distortion coefficients"),
        ({"distortion": np.array([np.inf, 0, 0, 0])}, "distortion coefficients"),
        ({"model": "magic"}, "expected plumb_bob"),
    ],
)
def test_a_camera_that_cannot_be_is_refused(change: dict[str, object], told: str) -> None:
    given_ = {"name": "east", "width": 648, "height": 488, "K": K, "distortion": np.zeros(5), "model": "plumb_bob"}
    with pytest.raises(CameraError, match=told):
        Camera(**{**given_, **change})  # type: ignore[arg-type]


def test_an_image_of_another_resolution_is_named() -> None:
    with pytest.raises(CameraError, match=r"a\.jpg: 1280 x 720 px, but camera 'none' was calibrated at 648 x 488"):
        camera("none").check_size(np.zeros((720, 1280), np.uint8), "a.jpg")
