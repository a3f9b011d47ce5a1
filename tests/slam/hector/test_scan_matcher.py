"""The alignment finds a displaced scan's pose, says how well it lies on the map, and how sure the pose is."""

import numpy as np
import pytest

from taskslam.slam.hector.mapper import HectorMapper
from taskslam.slam.hector.scan_matcher import align
from taskslam.slam.hector.settings import HectorSettings

STEPS = (4, 6)


@pytest.mark.parametrize("offset", [(0.08, 0.0, 0.0), (0.0, -0.08, 0.0), (0.0, 0.0, 0.06), (-0.06, 0.05, -0.05)])
def test_a_displaced_scan_is_brought_back(mapper, scan_at, offset) -> None:
    truth = np.array([0.2, 0.15, 0.1])
    found = align(mapper.levels, scan_at(*truth, seed=7).points, truth + np.array(offset), *STEPS)
    assert np.hypot(*(found.pose - truth)[:2]) < 0.03
    assert abs(found.pose[2] - truth[2]) < np.radians(0.4)
    assert found.score > 0.9


def test_a_coarse_level_reaches_further_than_the_finest_alone(mapper, scan_at) -> None:
    truth, start = np.array([0.2, 0.15, 0.0]), np.array([0.02, 0.02, 0.09])
    points = scan_at(*truth, seed=7).points
    both = align(mapper.levels, points, start, *STEPS)
    finest = align(mapper.levels[:1], points, start, *STEPS)
    assert np.hypot(*(both.pose - truth)[:2]) < 0.03
    assert np.hypot(*(finest.pose - truth)[:2]) > 0.05


def test_the_score_tells_a_scan_that_lies_beside_the_map(mapper, scan_at) -> None:
    far_off = align(mapper.levels, scan_at(0.5, 0.5, 1.0).points, np.array([0.5, 0.5, 0.0]), *STEPS)
    assert far_off.score < 0.4


def test_beyond_the_map_nothing_is_known_and_the_pose_stays(mapper, scan_at) -> None:
    start = np.array([500.0, 0.0, 0.3])
    found = align(mapper.levels, scan_at(0, 0, 0).points, start, *STEPS)
    assert found.known == 0.0
    np.testing.assert_array_equal(found.pose, start)


def test_the_pose_is_less_sure_along_a_corridor_than_across_it(drives, scan_at) -> None:
    """Without noise: the steps that it puts into the map's walls look like features to a Hessian."""
    corridor = np.array([(-50.0, -1.02, 50.0, -1.02), (50.0, 1.02, -50.0, 1.02)])
    mapper = HectorMapper(HectorSettings())
    scan = scan_at(0, 0, 0, noise=0.0, walls=corridor)
    mapper.process(scan, 0)
    found = align(mapper.levels, scan.points, np.zeros(3), *STEPS)
    deviations = np.sqrt(np.diag(found.covariance))
    assert deviations[0] > 2 * deviations[1]
    assert np.all(np.linalg.eigvalsh(found.covariance) > 0)


def test_covariance_is_of_the_size_of_the_scatter(mapper, scan_at) -> None:
    """Noise of the scans alone; the cells' own error is common to all and not in it."""
    truth = np.array([0.2, 0.15, 0.1])
    found = [align(mapper.levels, scan_at(*truth, seed=seed).points, truth, *STEPS) for seed in range(40)]
    scatter = np.std([f.pose for f in found], axis=0)
    said = np.sqrt(np.diag(found[0].covariance))
    assert np.all(said / scatter > 1 / 3)
    assert np.all(said / scatter < 5)
