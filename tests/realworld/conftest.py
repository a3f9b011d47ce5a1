"""Photographs of printed cells, exact to the lens: what a test can hold measured corners against."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from taskslam.lab.image import SAMPLES, Cards, draw, sheet
from taskslam.lab.lens import Backdrop, pixel_corners
from taskslam.realworld.cameras.camera_model import Camera

Photograph = Callable[..., np.ndarray]
_RIM = 4  # cells of white paper around what is printed


@cache
def _lens(camera: Camera) -> np.ndarray:
    corners = pixel_corners(camera.width, camera.height)
    return camera.undistort(corners.reshape(-1, 2)).reshape(corners.shape)


def _photograph(
    camera: Camera,
    cells: np.ndarray,
    cell: float,
    T_camera_board: np.ndarray,
    *,
    softness: float = 0.7,
    noise: float = 2.0,
    seed: int = 0,
) -> np.ndarray:
    """Grey image of cells (rows, columns; True white) of side `cell`, m, on a white card.

    T_camera_board: from the frame of the board: origin at the first cell's outer corner, x right, y down.
    """
    rows, columns = cells.shape
    side = max(rows, columns)
    square = np.ones((side, side), bool)
    square[:rows, :columns] = cells
    T_board_card = np.eye(4)
    T_board_card[:3, :3] = np.array([[0, -1, 0], [-1, 0, 0], [0, 0, -1]])  # x to the top, y to the left, z out of it
    T_board_card[:2, 3] = side * cell / 2
    poses = np.broadcast_to(T_camera_board @ T_board_card, (SAMPLES, 1, 4, 4))
    cards = Cards(sheet(square, _RIM)[None], (side + 2 * _RIM) * cell, np.ascontiguousarray(poses))
    shape = camera.height, camera.width
    empty = Backdrop(np.full(shape, 0.25, np.float32), np.full(shape, np.inf, np.float32))
    light, _ = draw(empty, _lens(camera), 1.0, cards, None)
    soft = gaussian_filter(light, softness) if softness else light
    grey = 235 * np.sqrt(soft) + np.random.default_rng(seed).normal(0, noise, shape)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


@pytest.fixture(scope="session")
def photograph() -> Photograph:
    """`photograph(camera, cells, cell, T_camera_board, softness=0.7, noise=2.0, seed=0)`."""
    return _photograph


@pytest.fixture(scope="session")
def webcam() -> Camera:
    """1280 x 720 with barrel distortion, like those of the published calibrations."""
    K = np.array([[790.0, 0, 640], [0, 792.0, 360], [0, 0, 1]])
    return Camera("webcam", 1280, 720, K, np.array([0.11, -0.17, 0.001, -0.002, 0.0]))


@pytest.fixture(scope="session")
def see() -> Callable[..., np.ndarray]:
    """`see(camera, T_camera_frame, points)`: pixels (P, 2), exact, of points (P, 2) in the plane z = 0 of a frame."""

    def project(camera: Camera, T_camera_frame: np.ndarray, points: np.ndarray) -> np.ndarray:
        flat = np.column_stack([points, np.zeros(len(points)), np.ones(len(points))])
        return camera.project((flat @ T_camera_frame.T)[:, :3])

    return project
