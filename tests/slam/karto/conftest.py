"""Drives recorded in `drives.py`, and scans of a square room to reason about."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from taskslam.measurements import LaserScan
from taskslam.slam.karto.scan_points import ScanPoints, scan_to_points


@pytest.fixture(scope="session")
def loop_drive(drives: ModuleType):
    """Once round the corridors, about 66 m, with the turtlebot2's odometry."""
    return drives.drive(drives.rooms(), drives.ROOMS_TOUR)


@pytest.fixture(scope="session")
def walls(drives: ModuleType) -> np.ndarray:
    """A room of 6 x 4 m with a cupboard, so that no two poses in it look alike."""
    return np.array(drives.box(0, 0, 6, 4) + drives.box(4, 0, 5, 0.8))


def scan_from(drives: ModuleType, walls: np.ndarray, pose: np.ndarray, noise: float = 0.0, seed: int = 0) -> ScanPoints:
    """A scan of 1024 rays from a sensor in the middle of the base at (3,) pose."""
    angles = np.linspace(-np.pi, np.pi, 1024, endpoint=False)
    ranges = drives.cast(walls, np.tile(pose[:2], (1024, 1)), pose[2] + angles)
    ranges = ranges + np.random.default_rng(seed).normal(0, 1, 1024) * noise
    scan = LaserScan(0, ranges.astype(np.float32), -np.pi, 2 * np.pi / 1024, 0.1, 20.0)
    return scan_to_points(scan, np.eye(4), 10.0)


@pytest.fixture(scope="session")
def scan_at(drives: ModuleType, walls: np.ndarray):
    def make(x: float, y: float, theta: float, noise: float = 0.0, seed: int = 0, where: np.ndarray = walls):
        return scan_from(drives, where, np.array([x, y, theta]), noise, seed)

    return make


@pytest.fixture(scope="session")
def follow(drives: ModuleType):
    """Feed a drive to a method: estimates (N, 3), truth (N, 3), statuses."""
    return drives.follow
