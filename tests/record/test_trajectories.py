import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from taskslam.errors import RecordError
from taskslam.record.trajectories import (
    SpatialTrajectory,
    Trajectory,
    read_spatial_trajectory,
    read_trajectory,
    seconds,
    write_trajectory,
)


def test_a_planar_trajectory_comes_back(tmp_path):
    rng = np.random.default_rng(1)
    stamps = np.array([0, 1, 20_000_000, 1_403_636_579_763_555_584], dtype=np.int64)
    poses = rng.uniform(-3, 3, (4, 3))
    write_trajectory(tmp_path / "a.tum", Trajectory(stamps, poses))
    back = read_trajectory(tmp_path / "a.tum")
    np.testing.assert_array_equal(back.stamps, stamps)
    np.testing.assert_array_equal(back.poses[:, :2], poses[:, :2])
    np.testing.assert_allclose(back.poses[:, 2], poses[:, 2], atol=1e-12)


def test_the_text_is_what_the_field_reads(tmp_path):
    write_trajectory(tmp_path / "a.tum", Trajectory(np.array([1_500_000_000]), np.array([[1.5, -2.0, math.pi]])))
    header, row = (tmp_path / "a.tum").read_text().splitlines()
    assert header.startswith("#")
    assert row.split()[:6] == ["1.500000000", "1.5", "-2.0", "0", "0", "0"]
    assert [float(word) for word in row.split()[6:]] == pytest.approx([1.0, 0.0], abs=1e-15)


def test_a_spatial_trajectory_comes_back_and_projects_to_the_same_plane(tmp_path):
    poses = np.tile(np.eye(4), (20, 1, 1))
    poses[:, :3, :3] = Rotation.random(20, random_state=3).as_matrix()
    poses[:, :3, 3] = np.random.default_rng(2).normal(size=(20, 3))
    trajectory = SpatialTrajectory.from_matrices(np.arange(20, dtype=np.int64), poses)
    write_trajectory(tmp_path / "a.tum", trajectory)
    back = read_spatial_trajectory(tmp_path / "a.tum")
    np.testing.assert_allclose(back.matrices(), poses, atol=1e-12)
    np.testing.assert_allclose(read_trajectory(tmp_path / "a.tum").poses, trajectory.planar().poses, atol=1e-12)


def test_an_empty_trajectory_comes_back_empty(tmp_path):
    write_trajectory(tmp_path / "a.tum", Trajectory(np.empty(0, dtype=np.int64), np.empty((0, 3))))
    assert len(read_trajectory(tmp_path / "a.tum")) == 0
    assert len(read_spatial_trajectory(tmp_path / "a.tum")) == 0


@given(st.integers(-(2**62), 2**62))
def test_nanoseconds_survive_the_text(stamp):
    from decimal import Decimal

    assert Decimal(seconds(stamp)) * 1_000_000_000 == stamp
    assert len(seconds(stamp).partition(".")[2]) == 9


def test_a_pose_that_is_not_finite_is_refused_by_number(tmp_path):
    poses = np.zeros((3, 3))
    poses[1, 0] = np.nan
    with pytest.raises(RecordError, match="pose 1 is not finite"):
        write_trajectory(tmp_path / "a.tum", Trajectory(np.arange(3), poses))
    assert not (tmp_path / "a.tum").exists()


@pytest.mark.parametrize(
    "line", ["1 2 3", "0 0 0 0 0 0 0 nan", "a 0 0 0 0 0 0 1", "0 0 0 0 0 0 0 2", "inf 0 0 0 0 0 0 1"]
)
def test_a_wrong_line_is_named(tmp_path, line):
    (tmp_path / "a.tum").write_text(f"# header\n0.0 0 0 0 0 0 0 1\n{line}\n")
    with pytest.raises(RecordError, match=r"a\.tum, line 3: expected eight finite numbers"):
        read_trajectory(tmp_path / "a.tum")
