from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import DiskFullError, RecordError
from taskslam.slam.methods.karto import Karto


@pytest.fixture(scope="module")
def first_drive(drives):
    walls = np.array(drives.box(0, 0, 9, 7) + drives.box(3, 3, 6, 4) + drives.box(0, 5.2, 0.5, 5.9))
    tour = np.array([(1.5, 1.5), (7.5, 1.5), (7.5, 5.5), (1.5, 5.5), (1.5, 1.5)])
    return drives.drive(walls, tour, speed=0.5), drives.drive(walls, tour, speed=0.5, seed=5)


@pytest.fixture(scope="module")
def mapped(drives, first_drive) -> Karto:
    method = Karto()
    method.start(first_drive[0].robot.rig)
    drives.follow(method, first_drive[0])
    return method


@pytest.fixture
def map_path(mapped: Karto, tmp_path: Path) -> Path:
    path = tmp_path / "hall.npz"
    mapped.save_map(path)
    return path


def started(first_drive) -> Karto:
    method = Karto()
    method.start(first_drive[0].robot.rig)
    return method


def test_a_second_round_on_a_loaded_map_starts_where_the_first_did(drives, first_drive, mapped, map_path) -> None:
    method = started(first_drive)
    method.load_map(map_path)
    before = method.map_summary()
    assert before.keyframes == mapped.map_summary().keyframes
    assert before.edges == mapped.map_summary().edges
    done = drives.follow(method, first_drive[1])
    assert done.errors.max() < 0.02
    assert set(done.statuses) == {"tracking"}
    assert method.map_summary().keyframes - before.keyframes < 0.15 * before.keyframes


def test_saving_a_loaded_map_again_gives_the_same_arrays(first_drive, map_path, tmp_path) -> None:
    method = started(first_drive)
    method.load_map(map_path)
    method.save_map(tmp_path / "again.npz")
    with np.load(map_path, allow_pickle=False) as one, np.load(tmp_path / "again.npz", allow_pickle=False) as two:
        assert sorted(one.files) == sorted(two.files)
        for name in one.files:
            assert one[name].tobytes() == two[name].tobytes()


@pytest.mark.parametrize("length", [0, 1, 100, 20_000])
def test_a_truncated_file_is_refused(first_drive, map_path, length) -> None:
    map_path.write_bytes(map_path.read_bytes()[:length])
    with pytest.raises(RecordError, match=r"hall\.npz"):
        started(first_drive).load_map(map_path)


def test_a_flipped_bit_is_refused(first_drive, map_path) -> None:
    content = bytearray(map_path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    map_path.write_bytes(content)
    with pytest.raises(RecordError, match=r"hall\.npz"):
        started(first_drive).load_map(map_path)


def test_a_missing_file_is_named(first_drive, tmp_path) -> None:
    with pytest.raises(RecordError, match=r"nowhere.npz.*No such file"):
        started(first_drive).load_map(tmp_path / "nowhere.npz")


def rewritten(path: Path, **changes: object) -> None:
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    arrays.update({name: np.asarray(value) for name, value in changes.items()})
    np.savez(path, **arrays)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": 99}, "version 99.*version 1"),
        ({"format": "a photograph"}, "not a karto map"),
        ({"poses": np.zeros((3, 3))}, "contradicts itself"),
        ({"edge_ends": np.full((2, 2), 10**6)}, "contradicts itself|edge to a keyframe"),
        ({"sizes": np.array([-1])}, "contradicts itself"),
        ({"version": "one"}, "version"),
    ],
)
def test_a_map_that_cannot_be_is_refused(first_drive, map_path, changes, message) -> None:
    rewritten(map_path, **changes)
    with pytest.raises(RecordError, match=message):
        started(first_drive).load_map(map_path)


def test_values_that_are_not_finite_are_refused(first_drive, map_path) -> None:
    with np.load(map_path) as file:
        poses = file["poses"].copy()
    poses[3, 1] = np.nan
    rewritten(map_path, poses=poses)
    with pytest.raises(RecordError, match="not finite"):
        started(first_drive).load_map(map_path)


def test_pickled_objects_are_not_read(first_drive, tmp_path) -> None:
    path = tmp_path / "evil.npz"
    np.savez(path, format=np.array([object()], dtype=object))
    with pytest.raises(RecordError, match="not a karto map"):
        started(first_drive).load_map(path)


def test_a_map_of_nothing_is_not_loaded(first_drive, tmp_path) -> None:
    started(first_drive).save_map(tmp_path / "empty.npz")
    with pytest.raises(RecordError, match="without keyframes"):
        started(first_drive).load_map(tmp_path / "empty.npz")


def test_an_unwritable_folder_is_named(mapped, tmp_path) -> None:
    with pytest.raises(DiskFullError, match="absent"):
        mapped.save_map(tmp_path / "absent" / "map.npz")
