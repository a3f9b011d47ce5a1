"""Tables of numbers in text files, read at once: a stamp and numbers a line, as TUM, EuRoC and KITTI files have it.

Stamps become integer nanoseconds without passing through floating point, all else the doubles that `float` would give.
Blank lines, and lines that begin with `#` or `%`, are left out. Whatever is wrong is told with its line, and ends the
reading or, by option, costs that line.
"""

from __future__ import annotations

import codecs
from collections.abc import Sequence
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.errors import RecordError
from taskslam.geometry import FloatArray
from taskslam.reading import LARGEST_TABLE, read_bytes
from taskslam.record.decimal_numbers import POWERS_OF_FIVE, read_double, read_scaled_integer

StampUnit: TypeAlias = Literal["seconds", "milliseconds", "microseconds", "nanoseconds"]
Bytes: TypeAlias = npt.NDArray[np.uint8]

_DECIMALS: dict[StampUnit | None, int] = {
    "seconds": 9, "milliseconds": 6, "microseconds": 3, "nanoseconds": 0, None: -1,
}  # fmt: skip
STAMP = -1
"""In a layout: the column of the stamp."""
_SKIPPED = -2
_INT64_MAX = 2**63 - 1


@dataclass(frozen=True)
class NumberTable:
    """What a file holds. stamps: (N,) ns, zeros if the file has none; values: (N, K); lines: (N,) counted from 1.

    cut_off: the last line ended in its middle (not readable, and no line end) and is left out; bad: (B,) lines that
    were not as expected and are left out; first_bad: the text of the first of them.
    """

    stamps: npt.NDArray[np.int64]
    values: FloatArray
    lines: npt.NDArray[np.int64]
    cut_off: bool = False
    bad: npt.NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    first_bad: str = ""


def read_number_table(
    path: Path,
    columns: int,
    expected: str,
    stamp_unit: StampUnit | None,
    separator: Literal[" ", ",", ";"] = " ",
    cut_off_allowed: bool = False,
    layout: Sequence[int | None] | None = None,
    skip_bad_lines: bool = False,
) -> NumberTable:
    """Read `columns` numbers a line, the first of them a stamp unless `stamp_unit` is None.

    separator: `" "` for blanks and tabs, with exactly these columns; `","` or `";"` with or without blanks, where
    columns behind these are left out. NaN and infinity are read as they stand, except in stamps. `expected` is what an
    error says of a line. cut_off_allowed: see `NumberTable.cut_off`. layout: for each column of the file, as many as
    matter, the place of its number among the values, or STAMP, or None for one that is passed over; columns behind
    these are left out. skip_bad_lines: see `NumberTable.bad`.

    Raises RecordError: the file cannot be read, or a line is not as expected and is not to be skipped.
    """
    stamped = stamp_unit is not None
    plain = [*([STAMP] if stamped else []), *range(columns - stamped)]
    places = np.array([_SKIPPED if place is None else place for place in (layout or plain)], np.int64)
    exactly = separator == " " and layout is None
    data: Bytes = np.frombuffer(as_utf8(read_bytes(path, "table of numbers", RecordError, LARGEST_TABLE)), np.uint8)
    last_line = int(np.count_nonzero(data == ord("\n"))) + 1
    room = min(last_line, len(data) // (2 * len(places)) + 1)  # a row is a digit and a blank for each column at least
    numbers = int(np.count_nonzero(places >= 0))
    table = NumberTable(np.zeros(room, np.int64), np.empty((room, numbers)), np.empty(room, np.int64))
    # Words that the compiled reader leaves to Python: their offset, by row and column; 0 where there is none.
    odd = np.zeros((room, len(places)), dtype=np.int64 if len(data) >= 2**31 else np.int32)
    wrong = np.empty(last_line if skip_bad_lines else 1, np.int64)
    how = (ord(separator), _DECIMALS[stamp_unit], exactly)
    rows, bad = _scan(data, how, places, POWERS_OF_FIVE, table.stamps, table.values, table.lines, odd, wrong)
    mistakes = _read_odd_words(data, odd[:rows], places, table, separator, stamp_unit, not skip_bad_lines)
    lines = np.unique(np.concatenate([wrong[:bad], np.array(list(mistakes), np.int64)]))
    cut_off = cut_off_allowed and last_line in lines
    bad_lines = lines[lines != last_line] if cut_off else lines
    if len(bad_lines) and not skip_bad_lines:
        first = int(bad_lines[0])
        raise RecordError(
            f"{path}, line {first}: expected {expected}, found {_line(data, first)!r}{mistakes.get(first, '')}"
        )
    whole = ~np.isin(table.lines[:rows], lines)
    found = f"{_line(data, int(bad_lines[0]))!r}" if len(bad_lines) else ""
    if whole.all():
        return NumberTable(table.stamps[:rows], table.values[:rows], table.lines[:rows], cut_off, bad_lines, found)
    kept = np.flatnonzero(whole)
    return NumberTable(table.stamps[kept], table.values[kept], table.lines[kept], cut_off, bad_lines, found)


def as_utf8(data: bytes) -> bytes:
    """Text without a byte order mark, in UTF-8 also where Windows wrote it in UTF-16."""
    if data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return data.decode("utf-16", "replace").encode()
    return data.removeprefix(codecs.BOM_UTF8)


def _read_odd_words(
    data: Bytes,
    odd: npt.NDArray[np.signedinteger],
    places: npt.NDArray[np.int64],
    table: NumberTable,
    separator: str,
    unit: StampUnit | None,
    first_only: bool,
) -> dict[int, str]:
    """Read the words that need a closer look: `nan`, many digits, stamps with an exponent.

    Returns the lines in which one is no number, each with a hint; of the first one alone by option.
    """
    scale = 10 ** max(_DECIMALS[unit], 0)
    mistakes: dict[int, str] = {}
    for row, column in np.argwhere(odd):
        if mistakes and first_only:
            break
        begin = int(odd[row, column]) - 1
        text = data[begin : begin + 400].tobytes().decode("ascii", "replace").replace(separator, " ")
        word = text.split(maxsplit=1)[0]
        try:
            if "_" in word or len(word) == 400:
                raise ValueError(word)
            if places[column] == STAMP:
                value = Decimal(word)
                # Looked at before it is made an integer: 1e999999 would have a million digits.
                in_range = value.is_finite() and value.adjusted() < 20
                stamp = int((value * scale).to_integral_value()) if in_range else _INT64_MAX + 1
                if abs(stamp) > _INT64_MAX:
                    hint = "; are these nanoseconds, where seconds belong?" if scale > 1 and value.is_finite() else ""
                    mistakes.setdefault(int(table.lines[row]), hint)
                    continue
                table.stamps[row] = stamp
            else:
                table.values[row, places[column]] = float(word)
        except (ValueError, InvalidOperation):
            mistakes.setdefault(int(table.lines[row]), "")
    return mistakes


def _line(data: Bytes, number: int) -> str:
    """The first 100 characters of a line, by its number."""
    ends = np.flatnonzero(data == ord("\n"))
    start = 0 if number == 1 else int(ends[number - 2]) + 1
    end = int(ends[number - 1]) if number - 1 < len(ends) else len(data)
    return data[start : min(end, start + 400)].tobytes().decode("utf-8", "backslashreplace").strip()[:100]


@njit(cache=True)
def _scan(
    data: Bytes,
    how: tuple[int, int, bool],
    places: npt.NDArray[np.int64],
    powers: npt.NDArray[np.uint64],
    stamps: npt.NDArray[np.int64],
    values: FloatArray,
    lines: npt.NDArray[np.int64],
    odd: npt.NDArray[np.signedinteger],
    wrong: npt.NDArray[np.int64],
) -> tuple[int, int]:
    """Fills the table, and `wrong` with lines that are not as expected until it is full. Returns how many of both.

    how: separator, decimals of a stamp, and whether a line has exactly as many words as there are places.
    """
    separator, decimals, exactly = how
    columns, bad = len(places), 0
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
        words, whole = 0, row < len(lines)
        while whole and at < size and data[at] != 10:
            begin = at
            while at < size and not (data[at] <= 32 or data[at] == separator):
                at += 1
            place = places[words] if words < columns else _SKIPPED
            if at == begin and (place != _SKIPPED or at == size or data[at] != separator):
                whole = False  # nothing between two commas, or a control character
                break
            if place == STAMP:
                stamps[row], usual = read_scaled_integer(data, begin, at, decimals)
                odd[row, words] = 0 if usual else begin + 1
            elif place >= 0:
                usual = read_double(data, begin, at, powers, bits)
                values[row, place] = number[0]
                odd[row, words] = 0 if usual else begin + 1
            words += 1
            at = _skip_blanks(data, at)
            if separator != 32 and at < size and data[at] != 10:
                if data[at] != separator:
                    whole = words > columns
                    break
                at = _skip_blanks(data, at + 1)
        if not whole or words < columns or (words > columns and exactly):
            odd[min(row, len(lines) - 1), :] = 0
            wrong[bad] = line
            bad += 1
            if bad == len(wrong):
                return row, bad
            while at < size and data[at] != 10:
                at += 1
        else:
            lines[row] = line
            row += 1
            while at < size and data[at] != 10:
                at += 1
        at += 1
    return row, bad


@njit(cache=True)
def _skip_blanks(data: Bytes, at: int) -> int:
    while at < len(data) and (data[at] == 32 or data[at] == 9 or data[at] == 13):
        at += 1
    return at
