import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from taskslam.evaluation.trajectory_resampling import resampled
from taskslam.record.trajectories import SpatialTrajectory


def drive(seed, count=30):
    rng = np.random.default_rng(seed)
    stamps = 1_700_000_000_000_000_000 + np.cumsum(rng.integers(40_000_000, 60_000_000, count))
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.4, (count, 3)), axis=0)).as_quat()
    turns *= rng.choice([-1.0, 1.0], (count, 1))  # q and -q are one rotation
    return SpatialTrajectory(stamps, rng.normal(size=(count, 3)), turns)


@given(seed=st.integers(0, 10_000), shift=st.integers(-200_000_000, 200_000_000))
@settings(max_examples=50, deadline=None, derandomize=True)
def test_agrees_with_scipy_inside_and_says_what_is_outside(seed, shift):
    trajectory = drive(seed)
    wanted = trajectory.stamps + shift
    found, there = resampled(trajectory, wanted)
    inside = (wanted >= trajectory.stamps[0]) & (wanted <= trajectory.stamps[-1])
    assert there.tolist() == inside.tolist()
    own, at = ((stamps - trajectory.stamps[0]) / 1e9 for stamps in (trajectory.stamps, wanted[inside]))
    for axis in range(3):
        assert np.allclose(found.positions[inside, axis], np.interp(at, own, trajectory.positions[:, axis]), atol=1e-9)
    turns = Slerp(own, Rotation.from_quat(trajectory.quaternions))(at)
    assert ((Rotation.from_quat(found.quaternions[inside]) * turns.inv()).magnitude() < 1e-7).all()


def test_gaps_are_no_poses_but_their_ends_are():
    trajectory = drive(1)
    kept = trajectory[np.r_[0:10, 20:30]]
    found, there = resampled(kept, trajectory.stamps)
    assert there.tolist() == [True] * 10 + [False] * 10 + [True] * 10
    assert np.array_equal(found.positions[there], kept.positions)


def test_a_single_pose_is_there_at_its_own_time_alone():
    one = drive(2)[:1]
    _, there = resampled(one, one.stamps[0] + np.array([-1, 0, 1]))
    assert there.tolist() == [False, True, False]
