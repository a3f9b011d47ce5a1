"""The published input files, read as they are: `waypoints.txt` and `path*.txt` (protocol 1.1)."""

from __future__ import annotations

import math
from pathlib import Path

from taskslam.errors import ScenarioError
from taskslam.reading import LARGEST_WRITTEN_BY_HAND, read_text

_MOST_DIGITS = 9


def read_waypoints(path: Path) -> list[list[float]]:
    """Rows `[x, y, theta]` (m, rad, frame `map`) of a table `index x y theta`; the row number is the id.

    Raises:
        ScenarioError: unreadable file, a row without four finite numbers.
    """
    rows: list[list[float]] = []
    for number, line in enumerate(_lines(path), start=1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        try:
            values = [float(word) for word in text.split()]
        except ValueError as error:
            raise ScenarioError(f"{path}, line {number}: expected `index x y theta`, found '{text[:80]}'") from error
        if len(values) != 4 or not all(math.isfinite(v) for v in values):
            raise ScenarioError(
                f"{path}, line {number}: expected four finite numbers `index x y theta`, found '{text[:80]}'"
            )
        rows.append(values[1:])
    return rows


def read_path(path: Path) -> list[int]:
    """Row indices of a visiting order, one a line; the first is the start and not a goal.

    Raises:
        ScenarioError: unreadable file, a line that is no whole number.
    """
    order: list[int] = []
    for number, line in enumerate(_lines(path), start=1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        if not text.isdecimal() or len(text) > _MOST_DIGITS:
            raise ScenarioError(f"{path}, line {number}: expected the number of a waypoint row, found '{text[:80]}'")
        order.append(int(text))
    return order


def _lines(path: Path) -> list[str]:
    return read_text(path, "waypoint file", ScenarioError, LARGEST_WRITTEN_BY_HAND).splitlines()
