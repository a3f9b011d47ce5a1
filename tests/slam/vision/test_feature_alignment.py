import numpy as np
import pytest

from taskslam.slam.vision.feature_alignment import align_patch, warp_patch

cv2 = pytest.importorskip("cv2")


@pytest.fixture
def image():
    noise = np.random.default_rng(3).integers(40, 216, (24, 32), dtype=np.uint8)
    return cv2.resize(noise, (160, 120), interpolation=cv2.INTER_CUBIC)


def shifted(image, x, y):
    return cv2.warpAffine(image, np.float32([[1, 0, x], [0, 1, y]]), (160, 120), flags=cv2.INTER_CUBIC)


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (0.4, -0.3), (1.25, 0.75), (-1.5, 1.0)])
def test_a_shift_is_found_as_opencvs_tracker_finds_it(image, x, y):
    moved = shifted(image, x, y)
    points = np.array([[50, 40], [71, 66], [100, 80], [33, 90], [120, 35]], np.float32)
    tracked, ok, _ = cv2.calcOpticalFlowPyrLK(image, moved, points[:, None], None, winSize=(9, 9), maxLevel=2)
    for point, expected, good in zip(points.astype(float), tracked[:, 0], ok[:, 0], strict=True):
        patch, whole = warp_patch(image, *point, np.eye(2))
        assert whole
        u, v, found = align_patch(moved, patch, tuple(point), (0.0, 0.0), 30)
        assert found
        np.testing.assert_allclose((u, v), point + np.array([x, y]), atol=0.12)
        if good:
            np.testing.assert_allclose((u, v), expected, atol=0.15)


def test_contrast_and_brightness_do_not_matter(image):
    other = np.clip(0.7 * shifted(image, 0.6, 0.2) + 30, 0, 255).astype(np.uint8)
    patch, _ = warp_patch(image, 71.0, 66.0, np.eye(2))
    u, v, found = align_patch(other, patch, (71.0, 66.0), (0.0, 0.0), 30)
    assert found
    np.testing.assert_allclose((u, v), (71.6, 66.2), atol=0.1)


def test_a_warped_patch_is_opencvs_affine_picture(image):
    A = np.array([[1.2, 0.2], [-0.1, 0.9]])
    patch, whole = warp_patch(image, 70.0, 60.0, A)
    offset = np.array([70.0, 60.0]) - A @ [4.5, 4.5]
    M = np.float32(np.column_stack([A, offset]))
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    assert whole
    np.testing.assert_allclose(patch, cv2.warpAffine(image.astype(np.float32), M, (10, 10), flags=flags), atol=3.0)


def test_an_edge_is_followed_along_its_normal_alone():
    ramp = np.clip(np.tile(20.0 * (np.arange(160) - 76), (120, 1)), 20, 230)
    patch, _ = warp_patch(ramp.astype(np.uint8), 80.0, 60.0, np.eye(2))
    moved = np.roll(ramp, 1, axis=1).astype(np.uint8)
    u, v, found = align_patch(moved, patch, (80.0, 60.0), (1.0, 0.0), 30)
    assert found
    assert u == pytest.approx(81.0, abs=0.1)
    assert v == 60.0


def test_what_is_not_there_is_not_found(image):
    patch, _ = warp_patch(image, 71.0, 66.0, np.eye(2))
    assert not align_patch(np.full((120, 160), 90, np.uint8), patch, (71.0, 66.0), (0.0, 0.0), 30)[2]
    assert not align_patch(image, patch, (2.0, 2.0), (0.0, 0.0), 30)[2]
    assert not warp_patch(image, 2.0, 50.0, np.eye(2))[1]
