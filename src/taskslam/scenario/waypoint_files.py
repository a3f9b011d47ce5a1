"""Files of waypoints, read as they are: the published `waypoints.txt` and `path*.txt` (protocol 1.1), and YAML."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from taskslam.errors import ScenarioError
from taskslam.reading import LARGEST_WRITTEN_BY_HAND, read_text
from taskslam.user_files import value_of

_MOST_DIGITS = 9


def read_waypoints(path: Path) -> list[Any]:
    """Rows `[x, y, theta]` (m, rad, frame `map`) of a table `index x y theta`; the row number is the id.

    Of a .yaml file, its list as it stands, of `{x, y, yaw}` or of rows, or the one under its key `waypoints`.

    Raises:
        ScenarioError: unreadable file, a row without four finite numbers, YAML without a list.
    """
    if path.suffix in (".yaml", ".yml"):
        return _yaml_list(path)
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


def _yaml_list(path: Path) -> list[Any]:
    content = value_of(
        read_text(path, "waypoint file", ScenarioError, LARGEST_WRITTEN_BY_HAND), str(path), ScenarioError
    )
    listed = content.get("waypoints") if isinstance(content, dict) else content
    if not isinstance(listed, list):
        raise ScenarioError(
            f"{path}: no list of waypoints; expected one of {{x, y, yaw}}, or the key `waypoints` with it"
        )
    return listed


def _lines(path: Path) -> list[str]:
    return read_text(path, "waypoint file", ScenarioError, LARGEST_WRITTEN_BY_HAND).splitlines()
