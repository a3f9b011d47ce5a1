import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from taskslam.evaluation.trajectory_alignment import Alignment
from taskslam.evaluation.trajectory_timing import find_time_offset, gaps_of
from taskslam.record.trajectories import SpatialTrajectory

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND


def drive(seed, seconds=60.0, rate=100):
    """A smooth drive: a sum of slow waves."""
    rng = np.random.default_rng(seed)
    at = np.arange(0, seconds, 1 / rate)
    frequencies, phases = rng.uniform(0.02, 0.15, (6, 3)), rng.uniform(0, 6, (6, 3))
    positions = np.sin(2 * np.pi * frequencies[:, None] * at[:, None] + phases[:, None]).sum(axis=0)
    quaternions = np.tile([0.0, 0, 0, 1], (len(at), 1))
    return SpatialTrajectory(START + (at * SECOND).astype(np.int64), positions, quaternions)


@given(seed=st.integers(0, 1000), offset=st.floats(-6, 6), kind=st.sampled_from(["se3", "sim3", "yaw", "none"]))
@settings(max_examples=15, deadline=None, derandomize=True)
def test_a_constant_offset_is_found(seed, offset, kind):
    truth = drive(seed)
    rng = np.random.default_rng(seed)
    run = truth[1500:4500:5]
    positions = run.positions + rng.normal(0, 0.005, run.positions.shape)
    if kind in ("se3", "sim3"):
        positions = Rotation.random(rng=rng).apply(positions) + 3
    run = SpatialTrajectory(run.stamps - round(offset * SECOND), positions, run.quaternions)
    found = find_time_offset(truth, run, Alignment(kind))
    assert found.seconds == pytest.approx(offset, abs=5e-3)
    assert found.rmse_shifted == pytest.approx(0.005 * np.sqrt(3), rel=0.2)
    assert found.rmse >= found.rmse_shifted


def test_clocks_that_began_at_different_times_are_looked_at_from_there():
    truth = drive(3)
    run = SpatialTrajectory(truth.stamps[::7] - START, truth.positions[::7], truth.quaternions[::7])
    assert find_time_offset(truth, run, Alignment.SE3) is None
    found = find_time_offset(truth, run, Alignment.SE3, start_s=START / SECOND + 1.3)
    assert found.seconds == pytest.approx(START / SECOND, abs=1e-3)


def test_a_run_of_a_few_poses_has_no_offset():
    truth = drive(4)
    assert find_time_offset(truth, truth[:5], Alignment.SE3) is None


def test_gaps_are_long_against_the_usual_step_and_longer_than_a_second():
    steps = np.array([50] * 20 + [900] + [50] * 20 + [3000] + [50] * 5 + [1200])
    found = gaps_of(np.cumsum(np.concatenate([[0], steps])) * 1_000_000)
    assert (found.count, found.seconds, found.longest_s) == (2, 4.2, 3.0)
    keyframes = np.cumsum(np.array([0, 2, 3, 2, 4, 2, 6])) * SECOND
    assert gaps_of(keyframes).count == 0
    assert gaps_of(keyframes[:1]).count == 0
