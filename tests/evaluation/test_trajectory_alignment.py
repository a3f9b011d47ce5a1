import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from taskslam.errors import TrajectoryError
from taskslam.evaluation.trajectory_alignment import Alignment, Similarity, align, noise_about_a_line
from taskslam.evaluation.trajectory_errors import absolute_errors
from taskslam.record.trajectories import SpatialTrajectory

FREE = [Alignment.SE3, Alignment.SIM3, Alignment.YAW]
seeds = st.integers(0, 2**32 - 1)


def random_trajectory(seed, count=60, extent=5.0):
    rng = np.random.default_rng(seed)
    return SpatialTrajectory(
        np.arange(count, dtype=np.int64),
        rng.normal(0, extent, (count, 3)),
        Rotation.random(count, random_state=seed % 997).as_quat(),
    )


def disturbed(trajectory, seed, size=0.1):
    rng = np.random.default_rng(seed)
    turns = Rotation.from_quat(trajectory.quaternions) * Rotation.from_rotvec(rng.normal(0, size, (len(trajectory), 3)))
    return SpatialTrajectory(
        trajectory.stamps, trajectory.positions + rng.normal(0, size, (len(trajectory), 3)), turns.as_quat()
    )


def motion(seed, kind):
    """A random motion of the kind that an alignment takes back."""
    rng = np.random.default_rng(seed)
    axis = np.array([0, 0, 1.0]) if kind is Alignment.YAW else rng.normal(size=3)
    turn = Rotation.from_rotvec(rng.uniform(-3, 3) * axis / np.linalg.norm(axis)).as_matrix()
    return Similarity(turn, rng.normal(0, 100, 3), rng.uniform(0.1, 10) if kind is Alignment.SIM3 else 1.0)


@pytest.mark.parametrize("kind", FREE)
@given(seed=seeds)
def test_a_moved_copy_comes_back(kind, seed):
    truth = random_trajectory(seed)
    back = align(motion(seed, kind).apply(truth), truth, kind).apply(motion(seed, kind).apply(truth))
    errors = absolute_errors(truth, back)
    assert errors.translation.max() < 1e-9
    assert errors.rotation.max() < 1e-9


@pytest.mark.parametrize("kind", FREE)
@given(seed=seeds)
def test_ate_does_not_depend_on_the_frame_of_the_estimate(kind, seed):
    truth, estimate = random_trajectory(seed), disturbed(random_trajectory(seed), seed + 1)
    moved = motion(seed + 2, kind).apply(estimate)
    plain, other = (absolute_errors(truth, align(e, truth, kind).apply(e)) for e in (estimate, moved))
    np.testing.assert_allclose(other.translation, plain.translation, atol=1e-8)
    np.testing.assert_allclose(other.rotation, plain.rotation, atol=1e-8)


@given(seed=seeds)
def test_ate_does_not_depend_on_the_frame_of_both(seed):
    truth, estimate = random_trajectory(seed), disturbed(random_trajectory(seed), seed + 1)
    move = motion(seed, Alignment.SE3)
    plain, other = absolute_errors(truth, estimate), absolute_errors(move.apply(truth), move.apply(estimate))
    np.testing.assert_allclose(other.translation, plain.translation, atol=1e-9)
    np.testing.assert_allclose(other.rotation, plain.rotation, atol=1e-9)


def test_more_freedom_never_leaves_a_greater_error():
    truth, estimate = random_trajectory(1), motion(2, Alignment.SIM3).apply(disturbed(random_trajectory(1), 3))
    sums = [
        (absolute_errors(truth, align(estimate, truth, kind).apply(estimate)).translation ** 2).sum()
        for kind in (Alignment.NONE, Alignment.YAW, Alignment.SE3, Alignment.SIM3)
    ]
    assert sums == sorted(sums, reverse=True)


def test_the_best_yaw_is_the_one_that_a_search_finds():
    truth = random_trajectory(4)
    estimate = motion(5, Alignment.SE3).apply(disturbed(truth, 6, size=1.0))
    found = align(estimate, truth, Alignment.YAW)

    def cost(yaw):
        turned = Rotation.from_euler("z", yaw).apply(estimate.positions)
        moved = turned - turned.mean(axis=0) + truth.positions.mean(axis=0)
        return ((moved - truth.positions) ** 2).sum()

    starts = np.linspace(-np.pi, np.pi, 9)
    best = min((minimize_scalar(cost, (a, a + 0.1)) for a in starts), key=lambda result: result.fun)
    residual = found.apply(estimate).positions - truth.positions
    assert (residual**2).sum() == pytest.approx(best.fun, rel=1e-9)
    np.testing.assert_allclose(found.rotation[2], [0, 0, 1])
    np.testing.assert_allclose(residual.mean(axis=0), 0, atol=1e-9)


def test_no_alignment_changes_nothing():
    truth = random_trajectory(7)
    same = align(truth, random_trajectory(8), Alignment.NONE).apply(truth)
    np.testing.assert_array_equal(same.positions, truth.positions)


def test_scale_is_found_by_sim3_alone():
    truth = random_trajectory(9)
    estimate = Similarity(np.eye(3), np.zeros(3), 0.25).apply(truth)
    assert align(estimate, truth, Alignment.SIM3).scale == pytest.approx(4.0)
    assert align(estimate, truth, Alignment.SE3).scale == 1.0


@pytest.mark.parametrize("kind", [Alignment.SE3, Alignment.SIM3])
@pytest.mark.parametrize("direction", [[0.0, 0, 0], [1.0, 2, 3]])
def test_a_straight_line_leaves_the_rotation_open(kind, direction):
    line = np.arange(20.0)[:, None] * np.array(direction)
    still = SpatialTrajectory(np.arange(20), line, np.tile([0.0, 0, 0, 1], (20, 1)))
    with pytest.raises(TrajectoryError, match="on a line or a point"):
        align(still, still, kind)


def test_a_line_is_enough_for_yaw_but_standing_still_is_not():
    upright = np.tile([0.0, 0, 0, 1], (20, 1))
    line = SpatialTrajectory(np.arange(20), np.arange(20.0)[:, None] * [1, 0, 0], upright)
    turned = SpatialTrajectory(np.arange(20), np.arange(20.0)[:, None] * [0, 1, 0], upright)
    np.testing.assert_allclose(align(line, turned, Alignment.YAW).apply(line).positions, turned.positions, atol=1e-12)
    lift = SpatialTrajectory(np.arange(20), np.arange(20.0)[:, None] * [0, 0, 1], upright)
    with pytest.raises(TrajectoryError, match="leaves yaw open"):
        align(lift, lift, Alignment.YAW)


def corridor(width, noise, seed=1):
    """A drive of 20 m along a line that sways by `width` m, and an estimate with `noise` m of noise."""
    rng = np.random.default_rng(seed)
    way = np.linspace(0, 20, 200)
    positions = np.column_stack([way, width * np.sin(way), width * np.cos(0.7 * way)])
    still = np.tile([0.0, 0, 0, 1], (200, 1))
    truth = SpatialTrajectory(np.arange(200), positions, still)
    return truth, SpatialTrajectory(np.arange(200), positions + rng.normal(0, noise, positions.shape), still)


@pytest.mark.parametrize(("width", "noise", "rests_on_noise"), [(1e-4, 1e-3, True), (1e-3, 1e-3, True),
                                                                (0.1, 1e-3, False), (0.1, 0.1, True), (3, 0.1, False),
                                                                (3, 3, False)])  # fmt: skip
def test_a_rotation_that_rests_on_noise_about_a_line_is_known(width, noise, rests_on_noise):
    truth, estimate = corridor(width, noise)
    aligned = align(estimate, truth, Alignment.SE3).apply(estimate)
    found = noise_about_a_line(aligned, truth)
    assert (found is not None) == rests_on_noise
    turned = absolute_errors(truth, aligned).rotation.mean()
    if found is not None:
        assert found[0] == pytest.approx(width / np.sqrt(2), rel=0.3, abs=1e-9)
        assert found[1] == pytest.approx(noise, rel=0.3)
    elif width < 1:
        assert turned < 0.01  # well-posed indeed
