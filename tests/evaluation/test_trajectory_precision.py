import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from taskslam.evaluation.trajectory_precision import frame_accuracy, frame_precision, published_frame_precision
from taskslam.evaluation.trajectory_rotations import mean_rotations


def runs(seed=0, frames=8, count=5, spread=0.1):
    rng = np.random.default_rng(seed)
    turns = Rotation.random(frames, random_state=seed)
    positions = rng.normal(0, 5, (frames, 1, 3)) + rng.normal(0, spread, (frames, count, 3))
    quaternions = np.stack(
        [(turns * Rotation.from_rotvec(rng.normal(0, spread, (frames, 3)))).as_quat() for _ in range(count)], axis=1
    )
    return positions, quaternions


def test_golden_values_of_one_frame():
    """Protocol 5.2's golden visits as poses in space: E 0.08 m, Delta 0.06 rad; e 0.09472136 m, delta 0.064 rad."""
    visits = np.array([[0, 0, 0], [0.1, 0, 0.1], [0, 0.1, -0.1], [-0.1, 0, 0.05], [0, -0.1, -0.05]])
    positions = np.column_stack([visits[:, :2], np.zeros(5)])[None]
    quaternions = Rotation.from_rotvec(visits[:, 2:] * [0, 0, 1]).as_quat()[None]
    precision = frame_precision(positions, quaternions)
    assert precision.position[0] == pytest.approx(0.08)
    assert precision.orientation[0] == pytest.approx(0.06, abs=1e-4)  # chordal mean, not the circular one of the angles
    goal = np.broadcast_to([0.05, 0.0, 0.0], (1, 5, 3))
    heading = np.broadcast_to(Rotation.from_euler("z", 0.02).as_quat(), (1, 5, 4))
    accuracy = frame_accuracy(positions, quaternions, goal, heading)
    assert accuracy.position[0] == pytest.approx(0.09472136)
    assert accuracy.orientation[0] == pytest.approx(0.064)


@given(st.integers(0, 2**31))
def test_precision_does_not_depend_on_the_common_frame_nor_on_the_order_of_runs(seed):
    positions, quaternions = runs(seed)
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed)
    moved = turn.apply(positions.reshape(-1, 3)).reshape(positions.shape) + rng.normal(0, 100, 3)
    turned = (turn * Rotation.from_quat(quaternions.reshape(-1, 4))).as_quat().reshape(quaternions.shape)
    order = rng.permutation(positions.shape[1])
    here, there = frame_precision(positions, quaternions), frame_precision(moved[:, order], turned[:, order])
    np.testing.assert_allclose(there.position, here.position, atol=1e-9)
    np.testing.assert_allclose(there.orientation, here.orientation, atol=1e-7)


def test_the_sign_of_a_quaternion_means_nothing():
    positions, quaternions = runs(1)
    flipped = quaternions * np.where(np.arange(5) % 2, -1.0, 1.0)[None, :, None]
    np.testing.assert_allclose(
        frame_precision(positions, flipped).orientation, frame_precision(positions, quaternions).orientation, atol=1e-9
    )
    np.testing.assert_allclose(np.abs(mean_rotations(flipped)), np.abs(mean_rotations(quaternions)), atol=1e-9)


def test_the_published_formula_adds_a_lever_arm_that_grows_with_the_distance_from_the_origin():
    """Protocol 5.9 h: 0.2 degrees at 10 m are 3.5 cm, in runs whose positions agree exactly."""
    turns = Rotation.from_rotvec([[0, 0, -0.2], [0, 0, 0.2]], degrees=True).as_quat()[None]
    for distance in (0.0, 10.0, 20.0):
        positions = np.tile([distance, 0.0, 0.0], (1, 2, 1))
        assert frame_precision(positions, turns).position[0] == 0.0
        published = published_frame_precision(positions, turns)
        assert published.position[0] == pytest.approx(distance * np.radians(0.2), abs=1e-6)
        assert published.orientation[0] == pytest.approx(np.radians(0.2))


def test_runs_that_agree_are_precise_however_inaccurate():
    positions, quaternions = runs(2, spread=0.0)
    precision = frame_precision(positions, quaternions)
    assert precision.position.max() < 1e-12
    assert precision.orientation.max() < 1e-7
    accuracy = frame_accuracy(positions, quaternions, positions + np.array([3.0, 4.0, 0.0]), quaternions)
    np.testing.assert_allclose(accuracy.position, 5.0)
