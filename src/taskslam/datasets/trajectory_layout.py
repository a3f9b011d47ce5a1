"""Which column of a text file means what: by its header where it has one, else by the form that its name promises.

A header names the columns in any order (`#timestamp [ns],tx,ty,tz,qx,qy,qz,qw`, `p_RS_R_x`, `field.pose.position.x`).
Without one, a table with commas and stamps in nanoseconds is EuRoC's (quaternion w x y z), any other TUM's (x y z w).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal, TypeAlias

from taskslam.errors import TrajectoryError
from taskslam.reading import open_file
from taskslam.record.number_table import STAMP, StampUnit, as_utf8
from taskslam.record.trajectories import COLUMNS

Separator = Literal[" ", ",", ";"]
Span: TypeAlias = tuple[float, float]
"""First and last stamp of a ground truth, s."""

KITTI_COLUMNS = 12
_HEAD = 65536  # bytes, in which a file shows what it is
_SAMPLES = 200  # lines
_TUM: tuple[int | None, ...] = (STAMP, 0, 1, 2, 3, 4, 5, 6)
_EUROC: tuple[int | None, ...] = (STAMP, 0, 1, 2, 6, 3, 4, 5)
_PLACES = {"x": 0, "y": 1, "z": 2, "qx": 3, "qy": 4, "qz": 5, "qw": 6}
_UNIT = re.compile(r"[\[(_]\s*(ns|nsec|nanoseconds|us|usec|ms|msec|s|sec|secs|seconds)\s*[\])]?$")
_UNITS: dict[str, StampUnit] = {"n": "nanoseconds", "u": "microseconds", "m": "milliseconds", "s": "seconds"}
_IN_SECONDS: dict[StampUnit, float] = {"seconds": 1.0, "milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9}
_EARLIEST_S, _LATEST_S = 6e8, 1e10  # 1989 and 2286: between them a stamp counts from 1970, not from a start
_USUAL_STEP_S, _LONG_STEP_S, _LONGEST_STEP_S = (1e-3, 20.0), (1e-4, 100.0), (1e-6, 3600.0)  # from pose to pose
_FEW_INSIDE, _MOST_INSIDE = 0.1, 0.5
_STAMP_NAME = re.compile(r"(?:.*[._])?(?:time_?stamps?|stamp|time|t|secs?)(?:_(?:ns|us|ms|s))?$|%time$")
_QUATERNION = re.compile(r"(?:.*\.)?(?:q|quat|quaternion|orientation|rot|rotation|o|r)(?:[._]\w+?)?[._]?([xyzw])$")
_POSITION = re.compile(r"(?:.*\.)?(?:(?:p|t|pos|position|trans|translation|loc|location)(?:[._]\w+?)?[._]?)?([xyz])$")


@dataclass(frozen=True)
class Layout:
    """How to read a file: see `read_number_table`. notes: what was guessed, a sentence each."""

    separator: Separator
    columns: tuple[int | None, ...]
    unit: StampUnit
    header_line: int = 0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Head:
    """The beginning of a file. names: of the columns, from a header; line: of a bare header; rows: words of lines."""

    separator: Separator
    rows: list[list[str]]
    names: tuple[str, ...] = ()
    line: int = 0


def read_head(path: Path) -> Head:
    """What the first 64 KiB show. Raises TrajectoryError if the file cannot be opened."""
    with open_file(path, "trajectory", TrajectoryError) as file:
        text = as_utf8(file.read(_HEAD)).decode("utf-8", "replace")
    lines = [line.strip() for line in text.split("\n")[: _SAMPLES + 50]]
    first = next((at for at, line in enumerate(lines) if line and line[0] not in "#%" and _is_number(line)), len(lines))
    data = [line for line in lines[first:] if line and line[0] not in "#%"][:_SAMPLES]
    separator = _separator(data[0] if data else "")
    above = [(at, line) for at, line in enumerate(lines[:first], start=1) if line]
    header_at, header = above[-1] if above else (0, "")
    names = tuple(name.strip().lower() for name in _split(header.lstrip("#% "), separator)) if header else ()
    bare = header_at if header and header[0] not in "#%" else 0
    return Head(separator, [_split(line, separator) for line in data], names, bare)


def layout_of(path: Path, head: Head, unit: StampUnit | None = None, span: Span | None = None) -> Layout:
    """The columns of a file that is not KITTI's. unit: of the stamps, if the user says it; span: of the ground truth.

    Raises TrajectoryError: the unit of the stamps is open; both candidates are named.
    """
    named, notes = _columns_by_name(head.names), []
    commas = head.separator != " "
    width = len(head.rows[0]) if head.rows else 8
    usual: StampUnit = "nanoseconds" if commas else "seconds"
    if named is not None:
        usual = _unit_by_name(head.names[named.index(STAMP)]) or usual
    chosen = unit or _fitting_unit(path, _stamps(head, named or _TUM), usual, span)
    if chosen != usual and unit is None:
        notes.append(f"stamps are taken for {chosen}, where {usual} are usual (--time-unit says it)")
    columns = named or (_EUROC if commas and chosen == "nanoseconds" else _TUM)
    if named is not None and named[:8] != (_EUROC if commas else _TUM):
        notes.append(f"columns are taken as its header names them: {', '.join(head.names[: len(named)])}")
    elif named is None and commas and not (path.suffix.lower() == ".csv" and columns == _EUROC):
        order = "w x y z" if columns == _EUROC else "x y z w"
        notes.append(f"commas without a header that names columns: the quaternion is taken for {order}")
    elif named is None and not commas and width > len(_TUM):
        notes.append(f"of {width} columns the first eight are read: {' '.join(COLUMNS)}")
    exactly = columns == _TUM and not commas and width == len(_TUM)
    return Layout(head.separator, () if exactly else columns, chosen, head.line if named else 0, tuple(notes))


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _is_number(line: str) -> bool:
    return _number(re.split(r"[\s,;]", line, maxsplit=1)[0]) is not None


def _separator(line: str) -> Separator:
    return "," if "," in line else ";" if ";" in line else " "


def _split(line: str, separator: Separator) -> list[str]:
    return line.split() if separator == " " else [word.strip() for word in line.split(separator)]


def _columns_by_name(names: tuple[str, ...]) -> tuple[int | None, ...] | None:
    """The layout that a header names, or None where it does not name a stamp, a position and a quaternion."""
    places: list[int | None] = []
    seen: set[int] = set()
    for name in names:
        bare = re.sub(r"\s*[\[(].*", "", name).strip()
        place: int | None = None
        if found := _QUATERNION.fullmatch(bare):
            place = _PLACES[f"q{found[1]}"]
        elif found := _POSITION.fullmatch(bare):
            place = _PLACES[found[1]]
        elif _STAMP_NAME.fullmatch(bare):
            place = STAMP
        place = None if place is None or place in seen else place
        places.append(place)
        seen |= set() if place is None else {place}
    if seen != {STAMP, *_PLACES.values()}:
        return None
    last = max(at for at, place in enumerate(places) if place is not None)
    return tuple(places[: last + 1])


def _unit_by_name(name: str) -> StampUnit | None:
    found = _UNIT.search(name)
    return _UNITS[found[1][0]] if found else None


def _stamps(head: Head, columns: tuple[int | None, ...]) -> list[float]:
    at = columns.index(STAMP)
    found = [_number(row[at]) for row in head.rows if len(row) > at]
    return [number for number in found if number is not None and math.isfinite(number)]


def _fitting_unit(path: Path, stamps: list[float], usual: StampUnit, span: Span | None) -> StampUnit:
    """The unit in which stamps lie before the year 2286 and follow one another as poses do; the usual one if it fits.

    Where the ground truth is known, a unit in which the stamps fall into its time stands above that.

    Raises TrajectoryError naming the candidates where several fit, and the usual one does not.
    """
    steps = sorted(b - a for a, b in pairwise(stamps) if b > a)
    step, latest = (steps[len(steps) // 2] if steps else 0.0), max(map(abs, stamps), default=0.0)

    def fits(unit: StampUnit, between: tuple[float, float]) -> bool:
        in_seconds = _IN_SECONDS[unit]
        return latest * in_seconds < _LATEST_S and (not steps or between[0] <= step * in_seconds <= between[1])

    def inside(unit: StampUnit) -> float:
        """Share of the stamps that fall into the time of the ground truth."""
        first, last = span or (0.0, 0.0)
        return sum(first <= stamp * _IN_SECONDS[unit] <= last for stamp in stamps) / max(len(stamps), 1)

    possible = [unit for unit in _IN_SECONDS if fits(unit, _LONG_STEP_S)]
    if span is not None and steps and inside(usual) < _FEW_INSIDE:
        found = [unit for unit in possible if inside(unit) > _MOST_INSIDE]
        if len(found) == 1:
            return found[0]
    if fits(usual, _LONGEST_STEP_S):
        return usual
    for between in (_USUAL_STEP_S, _LONG_STEP_S):
        found = [unit for unit in possible if fits(unit, between)]
        found = [unit for unit in found if latest * _IN_SECONDS[unit] > _EARLIEST_S] or found
        if len(found) == 1:
            return found[0]
        if found:
            raise TrajectoryError(
                f"{path}: poses follow each other after {step:g}, which may be {' or '.join(found)}; say --time-unit"
            )
    return usual
