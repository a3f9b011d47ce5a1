"""Scans of a furnished room, and a map of it."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

from taskslam.measurements import LaserScan
from taskslam.slam.hector.mapper import HectorMapper
from taskslam.slam.hector.settings import HectorSettings
from taskslam.slam.karto.scan_points import ScanPoints, scan_to_points

SECOND = 1_000_000_000
Scan = Callable[..., ScanPoints]


@pytest.fixture(scope="session")
def room(drives: ModuleType) -> np.ndarray:
    """6 x 4 m with a cupboard, a table and a niche; the robot starts at its (0, 0)."""
    return np.array(
        drives.box(-1.53, -1.32, 4.47, 2.68) + drives.box(2.5, -1.32, 3.6, -0.5) + drives.box(1, 1, 1.7, 1.5)
    )


@pytest.fixture(scope="session")
def scan_at(drives: ModuleType, room: np.ndarray) -> Scan:
    """A scan of 1024 rays, 10 m, noise of 1 cm, seen from (x, y, theta)."""

    def make(x: float, y: float, theta: float, seed: int = 0, noise: float = 0.01, walls: np.ndarray = room):
        angles = np.linspace(-np.pi, np.pi, 1024, endpoint=False)
        ranges = drives.cast(walls, np.tile([x, y], (1024, 1)), theta + angles)
        ranges = ranges + np.random.default_rng(seed).normal(0, 1, 1024) * noise
        return scan_to_points(
            LaserScan(0, ranges.astype(np.float32), -np.pi, 2 * np.pi / 1024, 0.1, 10.0), np.eye(4), 10.0
        )

    return make


@pytest.fixture
def mapper(scan_at: Scan) -> HectorMapper:
    """Has seen the room from several places around the start."""
    mapper = HectorMapper(HectorSettings())
    for k, (x, y) in enumerate([(0, 0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5), (0.0, 0.0)]):
        mapper.place(np.array([x, y, 0.0]))
        mapper.process(scan_at(x, y, 0.0, seed=100 + k), 0)
    mapper.place(np.zeros(3))
    return mapper
