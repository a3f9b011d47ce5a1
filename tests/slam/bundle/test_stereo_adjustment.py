"""Bundle adjustment against gtsam, which solves the same factor graph."""

import gtsam
import numpy as np
import pytest
from stereo_scene import PINHOLE, points, pose, see

from taskslam.geometry import invert_se3
from taskslam.slam.bundle.stereo_adjustment import (
    Sightings,
    adjust,
    factor_cholesky,
    reduced_equations,
    solve_cholesky,
    squared_errors,
    total_cost,
)
from taskslam.slam.vision.se3 import exp_se3

FREE, HELD, POINTS = 4, 2, 60


@pytest.fixture
def window():
    """Poses (the last two are held), points, both a little wrong, and noisy sightings of four keyframes a point."""
    random = np.random.default_rng(8)
    poses = np.stack([pose(random, 0.3, 0.05) for _ in range(FREE + HELD)])
    places = points(random, POINTS)
    keyframes = np.concatenate([np.sort(random.choice(FREE + HELD, 4, replace=False)) for _ in range(POINTS)])
    of_point = np.repeat(np.arange(POINTS), 4)
    seen = np.stack([see(poses[k], places[p][None])[0] for k, p in zip(keyframes, of_point, strict=True)])
    seen += random.normal(0, 0.5, seen.shape)
    sightings = Sightings(keyframes, seen, np.full(len(seen), 4.0), 4 * np.arange(POINTS + 1))
    start = poses.copy()
    for k in range(FREE):
        start[k] = pose(random, 0.03, 0.01) @ start[k]
    return start, places + random.normal(0, 0.05, places.shape), sightings


def test_gtsam_finds_the_same_minimum(window):
    poses, places, sightings = window
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    noise = gtsam.noiseModel.Isotropic.Sigma(3, 0.5)
    camera = gtsam.Cal3_S2Stereo(PINHOLE.f, PINHOLE.f, 0.0, PINHOLE.cx, PINHOLE.cy, PINHOLE.baseline)
    for k, T in enumerate(poses):
        values.insert(k, gtsam.Pose3(invert_se3(T)))
        if k >= FREE:
            graph.add(gtsam.NonlinearEqualityPose3(k, gtsam.Pose3(invert_se3(T))))
    for i, X in enumerate(places):
        values.insert(100 + i, X)
        for o in range(sightings.start[i], sightings.start[i + 1]):
            u, v, right = sightings.seen[o]
            seen = gtsam.StereoPoint2(u, right, v)
            graph.add(gtsam.GenericStereoFactor3D(seen, noise, int(sightings.keyframes[o]), 100 + i, camera))
    expected = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
    found, moved, cost = adjust(poses, FREE, places, sightings, PINHOLE, 30, False)
    assert cost == pytest.approx(2.0 * graph.error(expected), rel=1e-3)
    for k in range(FREE):
        np.testing.assert_allclose(found[k], invert_se3(expected.atPose3(k).matrix()), atol=2e-3)
    np.testing.assert_allclose(moved, [expected.atPoint3(100 + i) for i in range(POINTS)], atol=2e-2)
    np.testing.assert_array_equal(found[FREE:], poses[FREE:])


def test_the_reduced_system_is_the_schur_complement_of_the_whole(window):
    """Against the dense equations, assembled from differences of the cost."""
    poses, places, sightings = window
    system = reduced_equations(poses, FREE, places, sightings, PINHOLE, False, 0.0)
    J = np.zeros((3 * len(sightings.keyframes), 6 * FREE + 3 * POINTS))
    of_point = np.repeat(np.arange(POINTS), 4)
    step = 1e-6
    for o, (k, i) in enumerate(zip(sightings.keyframes, of_point, strict=True)):
        for axis in range(6):
            xi = np.zeros(6)
            xi[axis] = step
            if k < FREE:
                ahead, back = (see(exp_se3(s * xi) @ poses[k], places[i][None])[0] for s in (1.0, -1.0))
                J[3 * o : 3 * o + 3, 6 * k + axis] = (ahead - back) / (2 * step)
        for axis in range(3):
            dX = step * np.eye(3)[axis]
            ahead, back = (see(poses[k], (places[i] + s * dX)[None])[0] for s in (1.0, -1.0))
            J[3 * o : 3 * o + 3, 6 * FREE + 3 * i + axis] = (ahead - back) / (2 * step)
    H = 4.0 * J.T @ J
    U, W, V = H[: 6 * FREE, : 6 * FREE], H[: 6 * FREE, 6 * FREE :], H[6 * FREE :, 6 * FREE :]
    np.testing.assert_allclose(
        system.S, U - W @ np.linalg.solve(V, W.T), rtol=1e-4, atol=1e-2 * abs(system.S).max() / 1e3
    )


def test_the_cost_falls_and_outliers_stand_out(window):
    poses, places, sightings = window
    wrong = np.arange(0, len(sightings.keyframes), 17)
    sightings.seen[wrong, :2] += 30.0
    before = total_cost(poses, places, sightings, PINHOLE, True)
    poses, places, after = adjust(poses, FREE, places, sightings, PINHOLE, 10, True)
    assert after < 0.5 * before
    bad = np.flatnonzero(squared_errors(poses, places, sightings, PINHOLE) > 1.0)
    assert set(wrong) <= set(bad)
    assert len(bad) < 3 * len(wrong)


def test_what_weighs_nothing_changes_nothing(window):
    poses, places, sightings = window
    sightings.weights[::5] = 0.0
    expected = adjust(poses, FREE, places, sightings, PINHOLE, 5, True)
    sightings.seen[::5] += 1000.0
    found = adjust(poses, FREE, places, sightings, PINHOLE, 5, True)
    np.testing.assert_array_equal(found[0], expected[0])


def test_cholesky_is_numpys():
    random = np.random.default_rng(2)
    A = random.normal(size=(30, 40))
    A = A @ A.T
    np.testing.assert_allclose(factor_cholesky(A)[0], np.linalg.cholesky(A), atol=1e-10)
    b = random.normal(size=30)
    np.testing.assert_allclose(solve_cholesky(A, b)[0], np.linalg.solve(A, b), atol=1e-9)
    assert not solve_cholesky(-A, b)[1]
    assert not solve_cholesky(np.nan * A, b)[1]
