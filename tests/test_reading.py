"""Whatever stands where a file belongs, reading it ends at once: in its content, or in a sentence."""

import io
import os
import zipfile
import zlib

import numpy as np
import pytest
from PIL import Image

from taskslam.errors import RecordError
from taskslam.reading import MIB, open_file, opened_picture, read_arrays, read_bytes, read_json, read_text


def test_a_file_comes_back_as_it_is(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"\x00\xffcontent")
    assert read_bytes(path, "file", RecordError, 9) == b"\x00\xffcontent"
    path.write_text("Δ")
    assert read_text(path, "file", RecordError, 9) == "Δ"
    (tmp_path / "link").symlink_to(path)
    assert read_text(tmp_path / "link", "file", RecordError, 9) == "Δ"


def test_what_is_no_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("/dev/zero")
    for place in (tmp_path / "pipe", tmp_path / "link", "/dev/zero", "/dev/tty"):
        with pytest.raises(RecordError, match="cannot read the journal: "):
            read_bytes(tmp_path / place, "journal", RecordError, MIB)
    with pytest.raises(RecordError, match="cannot read the journal: found a folder, expected a file"):
        open_file(tmp_path, "journal", RecordError)
    with pytest.raises(RecordError, match="cannot read the journal: No such file"):
        open_file(tmp_path / "missing", "journal", RecordError)
    for impossible in ("a\0b", "a" * 5000, "\ud800"):
        with pytest.raises(RecordError, match="cannot read the journal: "):
            open_file(tmp_path / impossible, "journal", RecordError)


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    path = tmp_path / "sparse"
    with path.open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(RecordError, match="larger than 1 MB; expected a file that describes the scenario"):
        read_bytes(path, "scenario", RecordError, MIB)


@pytest.mark.parametrize(
    "text", ["", "{", "NaN", '{"a": Infinity}', "[" * 10_000, "9" * 5000, '"\\ud800"', "\xff", "[1, 2]]"]
)
def test_what_is_no_json_is_refused(tmp_path, text):
    path = tmp_path / "run.json"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(RecordError, match=r"run\.json: cannot read the run: not JSON"):
        read_json(path, "run", RecordError, MIB)


def archive(header: bytes, data: bytes = b"") -> bytes:
    """An npz whose array `a` has this header."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("a.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + data)
    return buffer.getvalue()


def test_arrays_come_back(tmp_path):
    arrays = {"a": np.arange(6.0).reshape(2, 3), "b": np.array("text"), "c": np.zeros((0, 4), np.int32)}
    np.savez_compressed(tmp_path / "map.npz", **arrays)
    found = read_arrays(tmp_path / "map.npz", "map", RecordError, MIB)
    assert found.keys() == arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array, strict=True)


@pytest.mark.parametrize(
    "content",
    [
        archive(b"{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999, 1000)}"),  # 90 TiB
        archive(b"{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}", b"\0" * 8),
        archive(b"{'descr': '|O', 'fortran_order': False, 'shape': (1,)}", b"\0" * 8),
        archive(b"{'descr': '<f8', 'fortran_order': False, 'shape': (0, 99999999999999999999)}"),
        archive(b"{'descr': '<U1', 'fortran_order': False, 'shape': ()}", b"\xff" * 4),
        archive(b"{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (1,)}", b"\0" * 8),
        archive(b"(" * 9000),
        archive(b"{}"),
        archive(b""),
        archive(b"{'descr': '|u1', 'fortran_order': False, 'shape': (8388608,)}", b"\0" * (8 * MIB)),  # of 8 kB
        b"",
    ],
)
def test_an_archive_that_is_damaged_or_promises_too_much_is_refused(tmp_path, content):
    (tmp_path / "map.npz").write_bytes(content)
    with pytest.raises(RecordError, match=r"map\.npz: not a map or cut short: "):
        read_arrays(tmp_path / "map.npz", "map", RecordError, MIB)


def test_a_picture_is_measured_before_it_is_decoded():
    side = 12_000
    rows = zlib.compress(b"\0" * (1 + side) * side)  # 144 million pixels in 140 kB

    def chunk(kind: bytes, data: bytes) -> bytes:
        return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")

    size = side.to_bytes(4, "big") * 2
    content = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", size + b"\x08\0\0\0\0") + chunk(b"IDAT", rows) + chunk(b"IEND", b"")
    with (
        pytest.raises(RecordError, match="a picture: 12000 x 12000 px; expected at most 134217728 pixels"),
        opened_picture(content, "a picture", RecordError, ("PNG",)),
    ):
        raise AssertionError("it was opened")


def test_a_picture_that_is_cut_off_is_refused_where_it_is_decoded():
    buffer = io.BytesIO()
    Image.effect_noise((64, 64), 50).save(buffer, format="PNG")
    with (
        pytest.raises(RecordError, match=r"a picture: not a whole picture \(.*\); expected PNG"),
        opened_picture(buffer.getvalue()[:900], "a picture", RecordError, ("PNG",)) as picture,
    ):
        picture.load()
