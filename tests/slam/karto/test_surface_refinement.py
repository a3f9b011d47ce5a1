import numpy as np
import pytest

from taskslam.slam.karto.keyframes import Keyframes
from taskslam.slam.karto.surface_refinement import SurfaceMap


def refined(
    scan_at, reference: np.ndarray, query: np.ndarray, offset: np.ndarray, noise: float, seed: int = 0, **where
):
    keyframes = Keyframes()
    number = keyframes.add(scan_at(*reference, noise=noise, seed=seed, **where), reference)
    shown = keyframes.reference([number], query)
    surfaces = SurfaceMap(11.0)
    surfaces.fill(shown.points, shown.normals, query)
    return surfaces.refine(scan_at(*query, noise=noise, seed=seed + 1000, **where), query + offset, query + offset)


def test_a_wrong_prediction_of_a_centimetre_is_undone_but_for_a_twentieth(scan_at) -> None:
    """What is left is the pull of the prior, 4 mm against the walls' one."""
    reference, query = np.array([2.0, 2.0, 0.3]), np.array([2.2, 1.9, 0.1])
    found = refined(scan_at, reference, query, np.array([0.01, -0.008, 0.006]), noise=0.0)
    assert np.abs(found.pose - query)[:2].max() < 7e-4
    assert abs(found.pose[2] - query[2]) < 2e-4
    assert found.share > 0.7


def test_noise_does_not_pull_the_pose_one_way(scan_at) -> None:
    reference, query = np.array([2.0, 2.0, 0.3]), np.array([2.2, 1.9, 0.1])
    errors = np.array(
        [refined(scan_at, reference, query, np.zeros(3), noise=0.01, seed=k).pose - query for k in range(40)]
    )
    assert np.abs(errors[:, :2]).max() < 0.005
    assert np.abs(errors.mean(axis=0)[:2]).max() < 5e-4
    assert abs(errors.mean(axis=0)[2]) < 2e-4


def test_an_open_direction_stays_as_predicted(scan_at) -> None:
    corridor = np.array([(-50.0, 0.0, 50.0, 0.0), (-50.0, 2.0, 50.0, 2.0)])
    query = np.array([0.0, 1.0, 0.0])
    found = refined(scan_at, np.array([0.3, 1.0, 0.0]), query, np.array([0.05, 0.01, 0.0]), noise=0.0, where=corridor)
    assert found.pose[1] == pytest.approx(1.0, abs=1e-3)
    assert found.pose[0] == pytest.approx(0.05, abs=5e-3)
    assert found.covariance[0, 0] > 10 * found.covariance[1, 1]


def test_nothing_shown_leaves_the_pose_and_says_so(scan_at) -> None:
    surfaces = SurfaceMap(11.0)
    surfaces.fill(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(3))
    start = np.array([1.0, 2.0, 0.5])
    found = surfaces.refine(scan_at(2.0, 2.0, 0.0), start, start)
    assert found.share == 0.0
    assert found.pose == pytest.approx(start)
