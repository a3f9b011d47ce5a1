import numpy as np
import pytest

from taskslam.errors import RecordError
from taskslam.slam.fast_lio2.map_file import read_map, write_map
from taskslam.slam.fast_lio2.settings import FastLio2Settings
from taskslam.slam.fast_lio2.voxel_map import VoxelMap


@pytest.fixture
def path(tmp_path):
    kept = VoxelMap(0.5, True)
    kept.insert(np.random.default_rng(0).uniform(-5, 5, (3000, 3)))
    write_map(tmp_path / "room.npz", kept, FastLio2Settings())
    return tmp_path / "room.npz"


def rewritten(path, **changes) -> None:
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    np.savez(path, **{**arrays, **{name: np.asarray(value) for name, value in changes.items()}})


def test_a_read_map_is_the_one_written(path) -> None:
    again, expected = VoxelMap(0.5, True), VoxelMap(0.5, True)
    read_map(path, again)
    expected.insert(np.random.default_rng(0).uniform(-5, 5, (3000, 3)))
    np.testing.assert_array_equal(np.unique(again.all_points(), axis=0), np.unique(expected.all_points(), axis=0))


def test_a_map_of_other_voxels_is_refused(path) -> None:
    with pytest.raises(RecordError, match=r"room\.npz: fast_lio2 map with voxels of 0\.5 m, expected 0\.2 m"):
        read_map(path, VoxelMap(0.2, True))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"points": np.zeros((3, 2))}, "no table of points"),
        ({"points": np.zeros((3, 3), np.float32)}, "no table of points"),
        ({"points": np.full((3, 3), 1e9)}, "no table of points"),
        ({"points": np.full((3, 3), np.nan)}, "not finite"),
        ({"points": np.zeros((3, 3))}, "3 points in 1 voxels"),
        ({"points": np.zeros((0, 3))}, "0 points in 0 voxels"),
        ({"size": "wide"}, "voxels of wide"),
        ({"size": np.ones(2)}, "voxels of"),
    ],
)
def test_a_map_that_cannot_be_is_refused(path, changes, message) -> None:
    rewritten(path, **changes)
    with pytest.raises(RecordError, match=message):
        read_map(path, VoxelMap(0.5, True))
