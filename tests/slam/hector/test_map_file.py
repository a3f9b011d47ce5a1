from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import RecordError
from taskslam.slam.hector.map_file import read_map, write_map
from taskslam.slam.hector.mapper import HectorMapper
from taskslam.slam.hector.settings import HectorSettings


@pytest.fixture
def path(mapper: HectorMapper, tmp_path: Path) -> Path:
    write_map(tmp_path / "room.npz", mapper, HectorSettings())
    return tmp_path / "room.npz"


def rewritten(path: Path, **changes: object) -> None:
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    arrays.update({name: np.asarray(value) for name, value in changes.items()})
    np.savez(path, **arrays)


def test_a_read_map_is_the_one_written_and_is_continued(mapper, scan_at, path) -> None:
    again = HectorMapper(HectorSettings())
    read_map(path, again)
    for one, two in zip(mapper.levels, again.levels, strict=True):
        np.testing.assert_array_equal(one.log_odds, two.log_odds)
        np.testing.assert_array_equal(one.origin, two.origin)
    scan = scan_at(0.05, 0.0, 0.02)
    np.testing.assert_array_equal(mapper.process(scan, 0).pose, again.process(scan, 0).pose)


def test_a_map_of_other_cells_is_refused(path) -> None:
    with pytest.raises(RecordError, match=r"room\.npz: hector map with cells of \[0\.05, 0\.1\] m, expected"):
        read_map(path, HectorMapper(HectorSettings(map_resolution=0.04)))
    with pytest.raises(RecordError, match="expected"):
        read_map(path, HectorMapper(HectorSettings(map_multi_res_levels=3)))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"log_odds_1": np.zeros((4, 4))}, "level 1 is no grid"),
        ({"log_odds_0": np.full((4, 4), 1e9, np.float32)}, "level 0 is no grid"),
        ({"log_odds_0": np.full((4, 4), np.nan, np.float32)}, "not finite"),
        ({"origin_0": np.array([0.012, 0.0])}, "level 0 is no grid"),
        ({"resolutions": "wide"}, "cells of wide"),
    ],
)
def test_a_map_that_cannot_be_is_refused(path, changes, message) -> None:
    rewritten(path, **changes)
    with pytest.raises(RecordError, match=message):
        read_map(path, HectorMapper(HectorSettings()))


def test_a_map_of_nothing_is_refused(tmp_path) -> None:
    write_map(tmp_path / "empty.npz", HectorMapper(HectorSettings()), HectorSettings())
    with pytest.raises(RecordError, match="without a scan"):
        read_map(tmp_path / "empty.npz", HectorMapper(HectorSettings()))
