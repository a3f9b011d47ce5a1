import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from taskslam.errors import TrajectoryError
from taskslam.evaluation.trajectory_errors import Statistics, relative_errors
from taskslam.evaluation.trajectory_pairs import DeltaUnit, pairs
from taskslam.record.trajectories import SpatialTrajectory


@pytest.fixture
def straight():
    """0.5 m and 9 degrees of yaw a step of 0.1 s, 21 poses."""
    stamps = np.arange(21, dtype=np.int64) * 100_000_000
    positions = np.arange(21.0)[:, None] * [0.5, 0.0, 0.0]
    return SpatialTrajectory(
        stamps, positions, Rotation.from_rotvec(np.arange(21)[:, None] * [0, 0, 9], degrees=True).as_quat()
    )


@pytest.mark.parametrize(
    ("delta", "unit", "step"),
    [(4, DeltaUnit.FRAMES, 4), (2.0, DeltaUnit.METRES, 4), (1.8, DeltaUnit.METRES, 4),
     (26.9, DeltaUnit.DEGREES, 3), (0.5, DeltaUnit.SECONDS, 5)],
)  # fmt: skip
def test_consecutive_pairs_begin_where_the_last_one_ended(straight, delta, unit, step):
    found = pairs(straight, delta, unit)
    assert found.second.tolist() == list(range(step, 21, step))
    assert found.first.tolist() == [second - step for second in found.second]


@pytest.mark.parametrize(("delta", "unit"), [(4, DeltaUnit.FRAMES), (2.0, DeltaUnit.METRES), (0.4, DeltaUnit.SECONDS)])
def test_all_pairs_begin_everywhere(straight, delta, unit):
    found = pairs(straight, delta, unit, all_pairs=True)
    assert found.first.tolist() == list(range(17))
    assert found.second.tolist() == list(range(4, 21))


def test_a_stop_does_not_stretch_a_pair(straight):
    positions = np.repeat(straight.positions[:6], [1, 1, 5, 1, 1, 1], axis=0)
    stop = SpatialTrajectory(np.arange(10), positions, np.tile([0.0, 0, 0, 1], (10, 1)))
    found = pairs(stop, 1.0, DeltaUnit.METRES, all_pairs=True)
    assert (found.first[0], found.second[0]) == (0, 2)


@pytest.mark.parametrize("delta", [0, -1, 1.5, float("nan"), float("inf")])
def test_a_delta_that_makes_no_sense_is_refused(straight, delta):
    with pytest.raises(TrajectoryError, match="expected a positive whole number"):
        pairs(straight, delta, DeltaUnit.FRAMES)


@pytest.mark.parametrize(
    ("delta", "unit"), [(30, DeltaUnit.FRAMES), (100.0, DeltaUnit.METRES), (900, DeltaUnit.SECONDS)]
)
def test_no_pair_is_an_error_that_says_so(straight, delta, unit):
    for all_pairs in (False, True):
        with pytest.raises(TrajectoryError, match="none of the 21 poses are that far apart"):
            pairs(straight, delta, unit, all_pairs)


def test_all_pairs_by_angle_are_refused(straight):
    with pytest.raises(TrajectoryError, match="all pairs are not offered"):
        pairs(straight, 10, DeltaUnit.DEGREES, all_pairs=True)


def test_an_empty_trajectory_has_no_pairs(straight):
    for unit in DeltaUnit:
        with pytest.raises(TrajectoryError, match="none of the 0 poses"):
            pairs(straight[:0], 1, unit)


def test_a_relative_error_sees_drift_and_not_the_frame(straight):
    turn = Rotation.from_rotvec([0.3, -2.0, 1.0])
    drifting = SpatialTrajectory(
        straight.stamps,
        turn.apply(1.02 * straight.positions) + np.array([7.0, 8.0, 9.0]),
        (turn * Rotation.from_quat(straight.quaternions)).as_quat(),
    )
    errors = relative_errors(straight, drifting, pairs(drifting, 4, DeltaUnit.FRAMES))
    np.testing.assert_allclose(errors.translation, 0.04)
    np.testing.assert_allclose(errors.rotation, 0.0, atol=1e-12)
    assert Statistics.of(errors.translation).rmse == pytest.approx(0.04)
