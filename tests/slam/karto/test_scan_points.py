import numpy as np
import pytest

from taskslam.measurements import LaserScan
from taskslam.slam.karto.scan_points import scan_to_points, thin


def laser_scan(ranges: list[float], range_max: float = 10.0) -> LaserScan:
    return LaserScan(0, np.array(ranges, np.float32), 0.0, 0.01, 0.1, range_max)


def test_rays_that_hit_nothing_usable_are_left_out() -> None:
    scan = laser_scan([np.inf, np.nan, -np.inf, 0.05, 0.0, -1.0, 10.0, 12.0, 2.0])
    points = scan_to_points(scan, np.eye(4), 10.0)
    assert points.points == pytest.approx(np.array([[2 * np.cos(0.08), 2 * np.sin(0.08)]]))


def test_the_shorter_of_sensor_range_and_setting_counts() -> None:
    scan = laser_scan([1.0, 4.0, 6.0])
    assert len(scan_to_points(scan, np.eye(4), 5.0)) == 2


def test_points_are_in_the_base_frame() -> None:
    mount = np.array([[0, -1, 0, 0.2], [1, 0, 0, 0.1], [0, 0, 1, 0.4], [0, 0, 0, 1.0]])  # turned left by 90 degrees
    points = scan_to_points(laser_scan([3.0]), mount, 10.0)
    assert points.points == pytest.approx(np.array([[0.2, 3.1]]))
    assert points.sensor == pytest.approx([0.2, 0.1])


def test_normals_face_the_sensor_and_stand_on_the_wall(scan_at) -> None:
    scan = scan_at(2.0, 2.0, 0.0, noise=0.005)
    left = np.abs(scan.points[:, 0] + 2.0) < 0.05
    left &= np.abs(scan.points[:, 1]) < 1.5
    assert left.sum() > 100
    assert np.abs(scan.normals[left] - [1.0, 0.0]).max() < 0.25
    assert np.abs(scan.normals[left].mean(axis=0) - [1.0, 0.0]).max() < 0.01


def test_a_lone_hit_has_no_normal() -> None:
    points = scan_to_points(laser_scan([3.0, 5.0, 7.0]), np.eye(4), 10.0)
    assert not points.normals.any()


def test_deskewing_undoes_the_motion_within_a_scan(drives, walls) -> None:
    rays = 1024
    angles = np.linspace(-np.pi, np.pi, rays, endpoint=False)
    share = np.arange(rays) / rays
    motion = np.stack([0.05 * share, 0.02 * share, 0.08 * share], axis=1)
    ranges = drives.cast(walls, np.array([2.0, 2.0]) + motion[:, :2], angles + motion[:, 2])
    scan = LaserScan(0, ranges.astype(np.float32), -np.pi, 2 * np.pi / rays, 0.1, 20.0, 97_656)
    deskewed = scan_to_points(scan, np.eye(4), 10.0, motion).points + 2.0
    distance = np.min(
        np.abs([deskewed[:, 0], deskewed[:, 0] - 6, deskewed[:, 1], deskewed[:, 1] - 4]), axis=0
    )  # to the nearest outer wall
    on_walls = (distance < 1e-5).mean()
    assert on_walls > 0.85  # the rest are hits on the cupboard
    skewed = scan_to_points(scan, np.eye(4), 10.0).points + 2.0
    assert (np.min(np.abs([skewed[:, 0], skewed[:, 0] - 6, skewed[:, 1]]), axis=0) < 1e-3).mean() < 0.2


def test_thinning_keeps_neighbours_apart() -> None:
    points = np.stack([np.linspace(0, 1, 101), np.zeros(101)], axis=1)
    kept = points[thin(points, 0.095)]
    assert len(kept) == 11
    assert np.diff(kept[:, 0]).min() >= 0.095
