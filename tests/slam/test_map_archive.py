import zipfile
from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import DiskFullError, RecordError
from taskslam.slam.map_archive import read_archive, write_archive

ARRAYS = {"poses": np.arange(6.0).reshape(2, 3)}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_archive(tmp_path / "map", "painter", 2, ARRAYS)
    return tmp_path / "map"


def test_what_is_written_is_read_and_nothing_is_left_beside_it(path) -> None:
    np.testing.assert_array_equal(read_archive(path, "painter", 2, {"poses"})["poses"], ARRAYS["poses"])
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize(
    ("method", "version", "names", "message"),
    [
        ("karto", 2, {"poses"}, "not a karto map"),
        ("painter", 3, {"poses"}, "map of version 2, and this program reads version 3"),
        ("painter", 2, {"poses", "edges"}, r"missing: edges"),
    ],
)
def test_another_map_is_refused(path, method, version, names, message) -> None:
    with pytest.raises(RecordError, match=message):
        read_archive(path, method, version, names)


def test_objects_are_neither_written_nor_read(tmp_path) -> None:
    with pytest.raises(ValueError, match="Object arrays"):
        write_archive(tmp_path / "map", "painter", 1, {"poses": np.array([object()], dtype=object)})
    np.savez(tmp_path / "evil.npz", poses=np.array([object()], dtype=object))
    with pytest.raises(RecordError, match="not a painter map"):
        read_archive(tmp_path / "evil.npz", "painter", 1, {"poses"})


def test_a_folder_that_is_absent_is_named(tmp_path) -> None:
    with pytest.raises(DiskFullError, match="absent"):
        write_archive(tmp_path / "absent" / "map", "painter", 1, ARRAYS)


def test_an_archive_that_promises_90_tebibytes_is_refused(path) -> None:
    with zipfile.ZipFile(path, "a") as archive:
        header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999, 1000)}"
        archive.writestr("huge.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header)
    with pytest.raises(RecordError, match=r"not a painter map or cut short: huge\.npy declares the shape"):
        read_archive(path, "painter", 2, {"poses"})
