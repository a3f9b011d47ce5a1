"""Tables of numbers in text files, read at once: a stamp and numbers a line, as TUM, EuRoC and KITTI files have it.

Stamps become integer nanoseconds without passing through floating point, all else the doubles that `float` would give.
Blank lines, and lines that begin with `#` or `%`, are left out. Whatever is wrong is told with its line.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.errors import RecordError
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.reading import LARGEST_TABLE, read_bytes
from taskslam.record.decimal_numbers import POWERS_OF_FIVE, read_double, read_scaled_integer

StampUnit: TypeAlias = Literal["seconds", "nanoseconds"]
Bytes: TypeAlias = npt.NDArray[np.uint8]

_DECIMALS: dict[StampUnit | None, int] = {"seconds": 9, "nanoseconds": 0, None: -1}
_INT64_MAX = 2**63 - 1


@dataclass(frozen=True)
class NumberTable:
    """What a file holds. stamps: (N,) ns, zeros if the file has none; values: (N, K); lines: (N,) counted from 1.

    cut_off: the last line ended in its middle (not readable, and no line end) and is left out.
    """

    stamps: npt.NDArray[np.int64]
    values: FloatArray
    lines: npt.NDArray[np.int64]
    cut_off: bool = False


class _BadLineError(Exception):
    def __init__(self, line: int, hint: str = "") -> None:
        self.line = line
        self.hint = hint


def read_number_table(
    path: Path,
    columns: int,
    expected: str,
    stamp_unit: StampUnit | None,
    separator: Literal[" ", ","] = " ",
    cut_off_allowed: bool = False,
) -> NumberTable:
    """Read `columns` numbers a line, the first of them a stamp unless `stamp_unit` is None.

    separator: `" "` for blanks and tabs, with exactly these columns; `","` for commas with or without blanks, where
    columns behind these are left out. NaN and infinity are read as they stand, except in stamps. `expected` is what an
    error says of a line. cut_off_allowed: see `NumberTable.cut_off`.

    Raises RecordError: the file cannot be read, or a line is not as expected.
    """
    data: Bytes = np.frombuffer(read_bytes(path, "table of numbers", RecordError, LARGEST_TABLE), dtype=np.uint8)
    last_line = int(np.count_nonzero(data == ord("\n"))) + 1
    room = min(last_line, len(data) // (2 * columns) + 1)  # a row is a digit and a blank for each column at least
    numbers = columns - (stamp_unit is not None)
    table = NumberTable(np.zeros(room, np.int64), np.empty((room, numbers)), np.empty(room, np.int64))
    # Words that the compiled reader leaves to Python: their offset, by row and column; 0 where there is none.
    odd = np.zeros((room, columns), dtype=np.int64 if len(data) >= 2**31 else np.int32)
    layout = (columns, ord(separator), _DECIMALS[stamp_unit])
    rows, bad_line = _scan(data, layout, POWERS_OF_FIVE, table.stamps, table.values, table.lines, odd)
    cut_off = False
    try:
        _read_odd_words(data, odd[:rows], table, separator, stamp_unit)  # of lines before the bad one
        if bad_line:
            raise _BadLineError(bad_line)
    except _BadLineError as bad:
        cut_off = cut_off_allowed and bad.line == last_line
        if not cut_off:
            raise RecordError(
                f"{path}, line {bad.line}: expected {expected}, found {_line(data, bad.line)!r}{bad.hint}"
            ) from None
        rows = int(np.searchsorted(table.lines[:rows], bad.line))
    return NumberTable(table.stamps[:rows], table.values[:rows], table.lines[:rows], cut_off)


def _read_odd_words(
    data: Bytes, odd: npt.NDArray[np.signedinteger], table: NumberTable, separator: str, unit: StampUnit | None
) -> None:
    """Read the words that need a closer look: `nan`, many digits, stamps with an exponent. Raises _BadLineError."""
    scale = NANOSECONDS if unit == "seconds" else 1
    for row, column in np.argwhere(odd):
        begin = int(odd[row, column]) - 1
        text = data[begin : begin + 400].tobytes().decode("ascii", "replace").replace(separator, " ")
        word = text.split(maxsplit=1)[0]
        try:
            if "_" in word or len(word) == 400:
                raise ValueError(word)
            if unit is not None and column == 0:
                value = Decimal(word)
                # Looked at before it is made an integer: 1e999999 would have a million digits.
                in_range = value.is_finite() and value.adjusted() < 20
                stamp = int((value * scale).to_integral_value()) if in_range else _INT64_MAX + 1
                if abs(stamp) > _INT64_MAX:
                    hint = "; are these nanoseconds, where seconds belong?" if scale > 1 and value.is_finite() else ""
                    raise _BadLineError(int(table.lines[row]), hint)
                table.stamps[row] = stamp
            else:
                table.values[row, column - (unit is not None)] = float(word)
        except (ValueError, InvalidOperation):
            raise _BadLineError(int(table.lines[row])) from None


def _line(data: Bytes, number: int) -> str:
    """The first 100 characters of a line, by its number."""
    ends = np.flatnonzero(data == ord("\n"))
    start = 0 if number == 1 else int(ends[number - 2]) + 1
    end = int(ends[number - 1]) if number - 1 < len(ends) else len(data)
    return data[start : min(end, start + 400)].tobytes().decode("utf-8", "backslashreplace").strip()[:100]


@njit(cache=True)
def _scan(
    data: Bytes,
    layout: tuple[int, int, int],
    powers: npt.NDArray[np.uint64],
    stamps: npt.NDArray[np.int64],
    values: FloatArray,
    lines: npt.NDArray[np.int64],
    odd: npt.NDArray[np.signedinteger],
) -> tuple[int, int]:
    """Fills the table. layout: columns, separator, decimals of a stamp (-1: none). Returns rows, and bad line or 0."""
    columns, separator, decimals = layout
    stamped = decimals >= 0
    bits = np.zeros(1, dtype=np.uint64)
    number = bits.view(np.float64)
    row, line, at, size = 0, 0, 0, len(data)
    while at < size:
        line += 1
        at = _skip_blanks(data, at)
        if at < size and (data[at] == 35 or data[at] == 37):
            while at < size and data[at] != 10:
                at += 1
        if at == size:
            break
        if data[at] == 10:
            at += 1
            continue
        lines[row] = line
        words = 0
        while at < size and data[at] != 10:
            begin = at
            while at < size and not (data[at] <= 32 or data[at] == separator):
                at += 1
            if at == begin:  # nothing between two commas, or a control character
                return row, line
            if words == 0 and stamped:
                stamps[row], usual = read_scaled_integer(data, begin, at, decimals)
                if not usual:
                    odd[row, 0] = begin + 1
            elif words < columns:
                if read_double(data, begin, at, powers, bits):
                    values[row, words - stamped] = number[0]
                else:
                    odd[row, words] = begin + 1
            words += 1
            at = _skip_blanks(data, at)
            if separator != 32 and at < size and data[at] != 10:
                if data[at] != separator:
                    return row, line
                at = _skip_blanks(data, at + 1)
        if words < columns or (words > columns and separator == 32):
            return row, line
        row += 1
        at += 1
    return row, 0


@njit(cache=True)
def _skip_blanks(data: Bytes, at: int) -> int:
    while at < len(data) and (data[at] == 32 or data[at] == 9 or data[at] == 13):
        at += 1
    return at
