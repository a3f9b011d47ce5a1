import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.errors import TrajectoryError
from taskslam.evaluation.trajectory_association import associate, associate_trajectories, common_frames
from taskslam.record.trajectories import SpatialTrajectory

ascending = st.lists(st.integers(0, 10**6), unique=True, max_size=40).map(lambda s: np.array(sorted(s), dtype=np.int64))


def still(*seconds):
    stamps = np.array([round(s * 1e9) for s in seconds], dtype=np.int64)
    return SpatialTrajectory(stamps, np.zeros((len(stamps), 3)), np.tile([0.0, 0, 0, 1], (len(stamps), 1)))


@given(ascending, ascending, st.integers(0, 10**5))
def test_every_pair_is_near_and_no_nearer_one_was_missed(a, b, limit):
    rows, matches = associate(a, b, limit)
    short, long, rows_short = (a, b, rows) if len(b) > len(a) else (b, a, matches)
    gaps = [np.abs(long - stamp).min(initial=2**60) for stamp in short]
    assert rows_short.tolist() == [row for row, gap in enumerate(gaps) if gap <= limit]
    np.testing.assert_array_equal(np.abs(a[rows] - b[matches]), [gaps[row] for row in rows_short])


def test_no_overlap_says_both_spans():
    with pytest.raises(
        TrajectoryError, match=r"do not overlap in time \(1\.000 s to 2\.000 s and 50\.000 s to 60\.000 s\)"
    ):
        associate_trajectories(still(1, 2), still(50, 60))


def test_an_overlap_without_near_stamps_is_told_apart():
    with pytest.raises(TrajectoryError, match="no two stamps are near enough"):
        associate_trajectories(still(1, 2, 3), still(1.5, 2.5))


@pytest.mark.parametrize(("reference", "estimate", "name"), [((), (1,), "ground truth"), ((1,), (), "trajectory")])
def test_an_empty_trajectory_is_named(reference, estimate, name):
    with pytest.raises(TrajectoryError, match=f"the {name} holds no pose"):
        associate_trajectories(still(*reference), still(*estimate))


def test_frames_are_the_same_up_to_rounding_of_stamps():
    a, b = still(1.000000, 1.05, 1.10), still(1.0000004, 1.1000009, 1.15)
    assert common_frames([a.stamps, b.stamps]).tolist() == [[0, 0], [1, -1], [2, 1], [-1, 2]]


def test_fast_sampling_keeps_its_frames_apart():
    stamps = 5_000_000_000 + np.arange(50, dtype=np.int64) * 200_000
    assert common_frames([stamps, stamps[10:] + 10]).tolist() == [
        [row, row - 10 if row >= 10 else -1] for row in range(50)
    ]


@given(st.lists(ascending, min_size=1, max_size=5))
def test_every_pose_belongs_to_exactly_one_frame(runs):
    table = common_frames([run * 20_000_000 for run in runs])
    for column, run in enumerate(runs):
        assert table[:, column][table[:, column] >= 0].tolist() == list(range(len(run)))
    assert len(table) == len(set().union(*(run.tolist() for run in runs)))
