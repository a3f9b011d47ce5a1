"""The Schur complement against gtsam, which eliminates the same equations as a factor graph."""

import gtsam
import numpy as np
import pytest

from taskslam.slam.bundle.schur import NormalEquations, solve_by_schur

POSES, POINTS = 4, 60


@pytest.fixture
def system():
    """Residuals between two poses and a point each, as a window's are; stacked and as gtsam's factors."""
    random = np.random.default_rng(4)
    graph = gtsam.GaussianFactorGraph()
    H, b = np.zeros((6 * POSES, 6 * POSES)), np.zeros(6 * POSES)
    W, h, g = np.zeros((POINTS, 6 * POSES)), np.zeros(POINTS), np.zeros(POINTS)
    unit = gtsam.noiseModel.Unit.Create(2)
    for point in range(POINTS):
        for target in range(1, POSES):
            A, B, C, r = (random.normal(size=shape) for shape in ((2, 6), (2, 6), (2, 1), (2,)))
            graph.add(0, A, target, B, POSES + point, C, -r, unit)
            J = np.zeros((2, 6 * POSES))
            J[:, :6], J[:, 6 * target : 6 * target + 6] = A, B
            H += J.T @ J
            b += J.T @ r
            W[point] += (J.T @ C)[:, 0]
            h[point] += C[:, 0] @ C[:, 0]
            g[point] += C[:, 0] @ r
    return graph, NormalEquations(H, b, W, h, g)


def test_gtsam_takes_the_same_step(system):
    graph, equations = system
    graph.add(0, 1e6 * np.eye(6), np.zeros(6), gtsam.noiseModel.Unit.Create(6))  # the first pose is held
    expected = graph.optimize()
    step, depths, solved = solve_by_schur(equations, 6, 0.0)
    assert solved
    np.testing.assert_array_equal(step[:6], 0.0)
    for pose in range(1, POSES):
        np.testing.assert_allclose(step[6 * pose : 6 * pose + 6], expected.at(pose), atol=1e-7)
    np.testing.assert_allclose(depths, [expected.at(POSES + point)[0] for point in range(POINTS)], atol=1e-7)


def test_a_point_that_nobody_sees_stays(system):
    _, equations = system
    equations.W[7], equations.h[7], equations.g[7] = 0.0, 0.0, 0.0
    _, depths, solved = solve_by_schur(equations, 6, 1e-4)
    assert solved
    assert depths[7] == 0.0
    assert np.isfinite(depths).all()


def test_damping_shortens_the_step(system):
    _, equations = system
    free, damped = (np.linalg.norm(solve_by_schur(equations, 6, damping)[0]) for damping in (0.0, 10.0))
    assert damped < 0.5 * free


def test_equations_of_no_numbers_are_not_solved(system):
    _, equations = system
    equations.H[:] = np.nan
    step, depths, solved = solve_by_schur(equations, 6, 0.0)
    assert not solved
    assert not step.any()
    assert not depths.any()
