import numpy as np
import pytest

from taskslam.errors import RecordError
from taskslam.record.number_table import read_number_table


def write(folder, content):
    path = folder / "table.txt"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def read(path, columns=3, unit="seconds", **options):
    return read_number_table(path, columns, "three numbers", unit, **options)


def test_comments_blank_lines_and_any_blanks_are_read_over(tmp_path):
    table = read(write(tmp_path, "# head\n\n  1.5\t2   3\r\n% other\n-0.000000001 -4 5e-1"))
    assert table.stamps.tolist() == [1_500_000_000, -1]
    assert table.values.tolist() == [[2, 3], [-4, 0.5]]
    assert table.lines.tolist() == [3, 5]


def test_stamps_are_exact_where_doubles_are_not(tmp_path):
    texts = ["1403636579.763555527", "1.403636579763555527e+09", "1403636579.7635555274", "1403636579.7635555265"]
    table = read(write(tmp_path, "".join(f"{text} 0 0\n" for text in texts)))
    assert table.stamps.tolist() == [1403636579763555527] * 3 + [1403636579763555526]


def test_commas_separate_and_further_columns_are_left_out(tmp_path):
    table = read(write(tmp_path, "#stamp,a\n1403636579763555527, 1.5 ,2,9\n5,3,4\n"), unit="nanoseconds", separator=",")
    assert table.stamps.tolist() == [1403636579763555527, 5]
    assert table.values.tolist() == [[1.5, 2], [3, 4]]


def test_numbers_without_stamps(tmp_path):
    table = read(write(tmp_path, "1 2 3\n4 5 6\n"), unit=None)
    assert table.values.tolist() == [[1, 2, 3], [4, 5, 6]]


def test_what_is_not_finite_is_read_as_it_stands(tmp_path):
    table = read(write(tmp_path, "1 nan -inf\n2 1 12345678901234567890123\n"))
    np.testing.assert_array_equal(table.values, [[np.nan, -np.inf], [1, 1.2345678901234567e22]])


@pytest.mark.parametrize("content", ["", "# only a comment", "\n\n\n"])
def test_a_file_without_numbers_is_an_empty_table(tmp_path, content):
    assert read(write(tmp_path, content)).values.shape == (0, 2)


@pytest.mark.parametrize(
    "line",
    ["1 2", "1 2 3 4", "1 2 x", "1,2,3", "x 2 3", "nan 2 3", "inf 2 3", "1e10 2 3", "99999999999 2 3", "1 2 1_0",
     "1 2 0x10", "1 2 \x00", "1 2 ü", "1;2;3", "1 2 " + "9" * 500],
)  # fmt: skip
def test_a_wrong_line_is_named(tmp_path, line):
    path = write(tmp_path, f"1 2 3\n# note\n{line}\n4 5 6\n")
    with pytest.raises(RecordError, match=r"table\.txt, line 3: expected three numbers, found '"):
        read(path)


@pytest.mark.parametrize("line", ["1,2", "1,,3", "1,2,3 4", ",1,2", "1 2 3"])
def test_a_wrong_line_of_commas_is_named(tmp_path, line):
    with pytest.raises(RecordError, match=r"table\.txt, line 2: expected three numbers"):
        read(write(tmp_path, f"1,2,3\n{line}\n4,5,6\n"), separator=",")


def test_a_last_line_that_was_cut_off_may_be_left_out(tmp_path):
    for rest in ("4 5", "4 5 0x", "4 5 1e", "1e"):
        path = write(tmp_path, f"1 2 3\n{rest}")
        table = read(path, cut_off_allowed=True)
        assert table.cut_off
        assert table.values.tolist() == [[2, 3]]
        with pytest.raises(RecordError, match="line 2"):
            read(path)
        with pytest.raises(RecordError, match="line 2"):
            read(write(tmp_path, f"1 2 3\n{rest}\n"), cut_off_allowed=True)


def test_the_first_wrong_line_is_named_whatever_is_wrong_with_a_later_one(tmp_path):
    for allowed in (False, True):
        with pytest.raises(RecordError, match="line 1: expected three numbers"):
            read(write(tmp_path, "1 2 -\n4 5"), cut_off_allowed=allowed)


def test_a_stamp_beyond_all_bounds_is_refused_without_being_written_out(tmp_path):
    for stamp in ("1e99999999", "1e999999999", "-1e400", "9" * 30, "Infinity"):
        with pytest.raises(RecordError, match="line 1: expected three numbers"):
            read(write(tmp_path, f"{stamp} 2 3\n"))


def test_a_folder_a_device_and_a_missing_file_are_refused(tmp_path):
    with pytest.raises(RecordError, match="found a folder"):
        read(tmp_path)
    with pytest.raises(RecordError, match="cannot read the table of numbers: No such file"):
        read(tmp_path / "missing.txt")
    from pathlib import Path

    with pytest.raises(RecordError, match="found a pipe or a device"):
        read(Path("/dev/zero"))


def test_blank_lines_take_no_room(tmp_path):
    table = read(write(tmp_path, "1 2 3\n" + "\n" * 5_000_000 + "4 5 6"))
    assert table.lines.tolist() == [1, 5_000_002]
    assert table.values.base.nbytes < 40_000_000
