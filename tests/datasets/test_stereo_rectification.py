"""Rectification against the geometry of the virtual pair: a scene that is a function of direction, seen both ways."""

from __future__ import annotations

import math

import numpy as np
import pytest

from taskslam.datasets.stereo_rectification import CameraCalibration, Rectifier, distort, mount_of
from taskslam.errors import DatasetError
from taskslam.geometry import OPTICAL_IN_BODY, pose_from_xyz_rpy

WIDTH, HEIGHT = 160, 120
INTRINSICS = {"left": (110.0, 109.0, 78.0, 61.0), "right": (108.0, 109.5, 83.0, 58.0)}
LENSES = [
    ("radial-tangential", (-0.28, 0.074, 0.0002, 0.0000176)),  # as EuRoC's cam0
    ("radial-tangential", (-0.2, 0.05, 0.001, -0.001, 0.01)),
    ("equidistant", (-0.02, 0.01, -0.003, 0.0005)),
]


def calibration(eye: str, model: str, coefficients: tuple[float, ...]) -> CameraCalibration:
    """Two cameras 11 cm apart, each turned a little away from the other."""
    y, tilt = (0.055, 0.02) if eye == "left" else (-0.055, -0.015)
    T = pose_from_xyz_rpy([0.1, y, 0.3], [0.5 * tilt, tilt, tilt]) @ OPTICAL_IN_BODY
    return CameraCalibration(WIDTH, HEIGHT, INTRINSICS[eye], model, coefficients, T)


def scene(directions: np.ndarray) -> np.ndarray:
    """Brightness of infinitely far things by their direction in the base; smooth."""
    x, y, z = np.moveaxis(directions / np.linalg.norm(directions, axis=-1, keepdims=True), -1, 0)
    return 128 + 60 * np.sin(9 * y + 2) * np.cos(7 * z) + 40 * np.sin(5 * x * z)


def photograph(camera: CameraCalibration) -> np.ndarray:
    """What the distorted camera sees of the scene: each pixel's ray found by inverting the lens with Newton's rule."""
    fx, fy, cx, cy = camera.intrinsics
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    wanted = np.stack([(u - cx) / fx, (v - cy) / fy], axis=-1)
    flat = wanted.copy()
    for _ in range(60):
        flat = flat + 0.7 * (wanted - distort(flat, camera.model, camera.coefficients))
    assert np.abs(distort(flat, camera.model, camera.coefficients) - wanted).max() < 1e-6
    rays = np.concatenate([flat, np.ones((HEIGHT, WIDTH, 1))], axis=-1) @ camera.T_base_optical[:3, :3].T
    return np.round(scene(rays)).astype(np.uint8)


@pytest.mark.parametrize(("model", "coefficients"), LENSES)
def test_a_distorted_pair_becomes_what_the_virtual_pair_would_have_seen(model, coefficients):
    left, right = (calibration(eye, model, coefficients) for eye in ("left", "right"))
    rectifier = Rectifier(left, right, 20.0, color=False)
    images = rectifier(photograph(left), photograph(right))
    camera = rectifier.camera
    f, (cx, cy) = camera.focal_length, camera.center
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    rays = np.stack([(u - cx) / f, (v - cy) / f, np.ones(u.shape)], axis=-1)
    expected = scene(rays @ (camera.mount.matrix() @ OPTICAL_IN_BODY)[:3, :3].T)
    for image in images:
        seen = image > 0
        assert seen.mean() > 0.75
        assert np.abs(image[seen] - expected[seen]).max() < 3  # grey levels: rounding and bilinear interpolation
        assert np.abs(image[seen] - expected[seen]).mean() < 0.5


def test_the_virtual_pair_stands_where_the_cameras_stand_side_by_side():
    left, right = (calibration(eye, "none", ()) for eye in ("left", "right"))
    camera = Rectifier(left, right, 20.0, color=False).camera
    T = camera.mount.matrix()
    assert np.allclose(T[:3, 3], left.T_base_optical[:3, 3])
    assert np.allclose(T @ [0, -camera.baseline, 0, 1], right.T_base_optical[:, 3])
    assert math.isclose(camera.baseline, 0.11)


def test_a_pair_that_is_rectified_already_passes_untouched():
    poses = [pose_from_xyz_rpy([0.1, y, 0.3], [0, 0, 0]) @ OPTICAL_IN_BODY for y in (0.0, -0.11)]
    pair = [CameraCalibration(96, 64, (50.0, 50.0, 48.0, 32.0), "none", (0.0, 0.0), T) for T in poses]
    rectifier = Rectifier(pair[0], pair[1], 20.0, color=False)
    image = np.arange(96 * 64, dtype=np.uint8).reshape(64, 96)
    assert rectifier.is_identity
    assert rectifier(image, image)[0] is image


def test_swapped_cameras_are_refused():
    left, right = (calibration(eye, "none", ()) for eye in ("left", "right"))
    with pytest.raises(DatasetError, match="swapped"):
        Rectifier(right, left, 20.0, color=False)


@pytest.mark.parametrize(
    "rpy", [(0.1, -0.2, 3.0), (-3.0, 1.2, -1.0), (0.3, math.pi / 2, 0.7), (0.0, -math.pi / 2, 1.0)]
)
def test_a_mount_is_the_pose_that_it_was_made_of(rpy):
    T = pose_from_xyz_rpy([1, 2, 3], rpy)
    assert np.allclose(mount_of(T).matrix(), T, atol=1e-12)
