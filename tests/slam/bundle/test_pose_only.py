"""The refined pose against gtsam, which adjusts the same projections."""

import gtsam
import numpy as np
import pytest

from taskslam.geometry import invert_se3
from taskslam.slam.bundle.pose_only import refine_pose
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.se3 import exp_se3

PINHOLE = Pinhole(360.0, 376.0, 240.0, 0.11)
TRUE = exp_se3(np.array([0.2, -0.1, 0.3, 0.1, -0.2, 0.05]))
START = exp_se3(np.array([0.22, -0.08, 0.27, 0.12, -0.18, 0.06]))


@pytest.fixture
def seen():
    """Points in the world and noisy pixels of a camera at `T_camera_world` TRUE."""
    random = np.random.default_rng(0)
    in_camera = random.uniform((-2, -1, 2), (2, 1, 6), (80, 3))
    points = (np.c_[in_camera, np.ones(80)] @ invert_se3(TRUE).T)[:, :3]
    pixels = PINHOLE.f * in_camera[:, :2] / in_camera[:, 2:] + (PINHOLE.cx, PINHOLE.cy)
    return points, pixels + random.normal(0, 0.4, pixels.shape)


def refine(points, pixels, normals=None, robust=True):
    normals = np.zeros((len(points), 2)) if normals is None else normals
    return refine_pose(START, points, pixels, normals, np.ones(len(points)), PINHOLE, 20, robust)


def test_gtsam_finds_the_same_pose(seen):
    points, pixels = seen
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    calibration = gtsam.Cal3_S2(PINHOLE.f, PINHOLE.f, 0.0, PINHOLE.cx, PINHOLE.cy)
    unit, held = gtsam.noiseModel.Unit.Create(2), gtsam.noiseModel.Isotropic.Sigma(3, 1e-9)
    values.insert(0, gtsam.Pose3(invert_se3(START)))
    for n, (point, pixel) in enumerate(zip(points, pixels, strict=True), start=1):
        values.insert(n, point)
        graph.add(gtsam.PriorFactorPoint3(n, point, held))
        graph.add(gtsam.GenericProjectionFactorCal3_S2(pixel, unit, 0, n, calibration))
    expected = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize().atPose3(0).matrix()
    found, errors, solved = refine(points, pixels, robust=False)
    assert solved
    np.testing.assert_allclose(found, invert_se3(expected), atol=1e-5)
    assert np.median(errors) < 0.6


def test_a_fifth_of_wrong_matches_does_not_move_it(seen):
    """From where sparse alignment leaves it, within a pixel."""
    points, pixels = seen
    pixels[::5] += np.random.default_rng(2).uniform(-40.0, 40.0, (16, 2))
    near = exp_se3(np.full(6, 2e-3)) @ TRUE
    rest = np.zeros((80, 2)), np.ones(80), PINHOLE, 20
    (robust, errors, _), (plain, _, _) = (refine_pose(near, points, pixels, *rest, each) for each in (True, False))
    np.testing.assert_allclose(robust, TRUE, atol=4e-3)
    assert np.abs(plain - TRUE).max() > 3 * np.abs(robust - TRUE).max()
    assert np.median(np.delete(errors, np.s_[::5])) < 0.8


def test_edges_count_across_alone(seen):
    """Each pixel slid along its edge by up to ten pixels: what lies across still tells the pose."""
    points, pixels = seen
    random = np.random.default_rng(1)
    angle = random.uniform(0, 2 * np.pi, len(points))
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    slid = pixels + normals[:, ::-1] * (-1, 1) * random.uniform(-10, 10, (len(points), 1))
    found, errors, solved = refine(points, slid, normals)
    assert solved
    np.testing.assert_allclose(found, TRUE, atol=5e-3)
    assert np.median(errors) < 0.6


def test_two_points_determine_nothing(seen):
    points, pixels = seen
    assert not refine(points[:0], pixels[:0])[2]
    assert np.isfinite(refine(points[:2], pixels[:2])[0]).all()
