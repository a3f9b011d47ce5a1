"""Noise by counters: Gaussian, white within a frame and from frame to frame, and nothing but its stream's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from taskslam.geometry import SE2
from taskslam.measurements import LaserScan, PointCloud
from taskslam.robot import load_robot
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.counted_noise import next_key, standard_normal
from taskslam.simulation.sensors.lidar import LaserScanner
from taskslam.simulation.sensors.lidar_3d import SpinningLidar
from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.simulation.streams import stream
from taskslam.world import World

FRAMES, SIZE = 40, 7040  # of a VLP-16's turn


@pytest.fixture(scope="module")
def draws() -> np.ndarray:
    """(10, FRAMES, SIZE) of ten seeds."""
    sources = [stream(seed, "lidar_3d/range_noise", 1) for seed in range(10)]
    return np.array([[standard_normal(next_key(source), (SIZE,)) for _ in range(FRAMES)] for source in sources], float)


def test_it_is_standard_normal_for_every_seed(draws: np.ndarray) -> None:
    count = FRAMES * SIZE
    for one in draws.reshape(len(draws), -1):
        assert abs(one.mean()) < 4.0 / np.sqrt(count)
        assert abs(one.std() - 1.0) < 4.0 / np.sqrt(2 * count)
        assert abs(stats.skew(one)) < 4.0 * np.sqrt(6 / count)
        assert abs(stats.kurtosis(one)) < 4.0 * np.sqrt(24 / count) + 0.001
        assert stats.kstest(one, "norm").pvalue > 1e-4
    assert draws.max() > 4.0


def test_no_draw_tells_another(draws: np.ndarray) -> None:
    """Neither along a frame, nor from frame to frame, nor from seed to seed; also not by its size alone."""
    for some in (draws, draws**2 - 1.0):
        power = np.mean(some**2)
        lags = {f"{lag} draws on": np.mean(some[..., lag:] * some[..., :-lag]) for lag in (*range(1, 70), 440, 880)}
        lags |= {f"{lag} frames on": np.mean(some[:, lag:] * some[:, :-lag]) for lag in range(1, 9)}
        lags["the next seed"] = np.mean(some[1:] * some[:-1])
        limit = 4.5 / np.sqrt(some.size / 2)
        assert {name: value for name, value in lags.items() if abs(value) / power > limit} == {}


def test_a_frame_is_the_same_whatever_its_shape_and_length() -> None:
    whole = standard_normal(7, (1000,))
    assert np.array_equal(standard_normal(7, (20, 50)), whole.reshape(20, 50))
    for length in (1, 15, 16, 63, 64, 65, 129):
        assert np.array_equal(standard_normal(7, (length,)), whole[:length])
    assert not np.isin(standard_normal(8, (1000,))[:3], whole[:3]).any()


@pytest.mark.parametrize(("part", "device"), [("lidar_2d", LaserScanner), ("lidar_3d", SpinningLidar)])
def test_what_a_lidar_adds_is_its_stream_times_its_sheets_sigma(
    part: str, device: type[LaserScanner | SpinningLidar], room: World
) -> None:
    sheet = getattr(load_robot("turtlebot2").rig, part)
    if part == "lidar_2d":
        sheet = sheet.model_copy(update={"resolution": 0.0})
    rays, motion = RayCaster(room.visual), Motion(0, SE2(-2.0, -1.0, 0.3))

    def ranges(seed: int, sigma: float, count: int = 1) -> np.ndarray:
        sensor = device(sheet.model_copy(update={"noise": sigma, "range_min": 0.5, "range_max": 90.0}), rays, seed)
        sensor.reset(1)
        frames = [sensor.measure(0, motion) for _ in range(count)]
        flat = [m.ranges if isinstance(m, LaserScan) else np.linalg.norm(m.points, axis=1) for m in frames]
        assert all(isinstance(m, LaserScan | PointCloud) for m in frames)
        return np.array(flat, float)

    true = ranges(0, 0.0)
    errors = np.concatenate([ranges(seed, 0.02, count=4) - true for seed in range(10)])
    errors = errors[np.isfinite(errors)] / 0.02
    assert abs(errors.mean()) < 4.0 / np.sqrt(errors.size)
    assert abs(errors.std() - 1.0) < 4.0 / np.sqrt(2 * errors.size)
    assert np.array_equal(ranges(3, 0.02), ranges(3, 0.02))
    assert not np.array_equal(ranges(3, 0.02), ranges(4, 0.02))
