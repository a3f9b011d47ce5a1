"""The tables of an EuRoC/ASL folder: `data.csv` with a stamp first in each row, `sensor.yaml` beside it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from taskslam.datasets.share import Share
from taskslam.errors import DatasetError
from taskslam.geometry import FloatArray, is_rigid
from taskslam.reading import open_file
from taskslam.user_files import read_mapping

_LONGEST_LINE = 4096
_LATEST = 1 << 61  # ns: the year 2043, and half of what the schedule of a method can count


@dataclass(frozen=True, slots=True)
class Row:
    """One row: where it stands, its stamp (ns), and its other cells as text."""

    where: str
    stamp: int
    cells: list[str]

    def numbers(self, count: int) -> list[float]:
        """The first cells as finite numbers. Raises DatasetError."""
        try:
            values = [float(cell) for cell in self.cells[:count]]
        except ValueError:
            values = []
        if len(values) != count or not all(map(math.isfinite, values)):
            raise DatasetError(
                f"{self.where}: expected a stamp and {count} finite numbers, found '{','.join(self.cells)[:100]}'"
            )
        return values


def read_rows(path: Path, share: Share | None = None) -> Iterator[Row]:
    """Rows of a data.csv one after the other; comments and empty lines are passed over.

    share: skips and counts rows whose stamp is no whole number of nanoseconds, or not later than the one before.

    Raises:
        DatasetError: unreadable, not text, a line of more than 4096 bytes; without `share`, also a wrong stamp.
    """
    previous = -1
    try:
        with open_file(path, "table", DatasetError) as file:
            number = 0
            while line := file.readline(_LONGEST_LINE):
                number += 1
                where = f"{path}, line {number}"
                if len(line) == _LONGEST_LINE:
                    raise DatasetError(f"{where}: longer than {_LONGEST_LINE} bytes; expected a row of a table")
                text = line.decode("utf-8", "replace").strip()
                if not text or text.startswith("#"):
                    continue
                stamp, *cells = (cell.strip() for cell in text.split(","))
                wrong = _wrong_with(stamp, previous)
                if wrong and share is not None:
                    share.skip(where, DatasetError(wrong))
                    continue
                if wrong:
                    raise DatasetError(f"{where}: {wrong}")
                previous = int(stamp)
                yield Row(where, previous, cells)
    except OSError as error:
        raise DatasetError(f"{path}: cannot be read: {error.strerror}") from error


def _wrong_with(stamp: str, previous: int) -> str:
    if not (stamp.isascii() and stamp.isdigit() and len(stamp) < 20 and int(stamp) < _LATEST):
        return f"expected a stamp in whole nanoseconds first, found '{stamp[:40]}'"
    return f"stamp {stamp} is not later than {previous} before it" if int(stamp) <= previous else ""


@dataclass(frozen=True)
class SensorFile:
    """A sensor.yaml: its keys, with typed access that says which key is wrong."""

    path: Path
    keys: dict[str, Any]

    def number(self, key: str, default: float | None = None) -> float:
        """A finite number that is not negative. Raises DatasetError."""
        value = self.keys.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value < 0:
            raise DatasetError(f"{self.path}: {key}: expected a number that is not negative, found {value!r:.60}")
        return float(value)

    def numbers(self, key: str, counts: tuple[int, ...]) -> tuple[float, ...]:
        """A list of so many finite numbers. Raises DatasetError."""
        value = self.keys.get(key)
        if (
            not isinstance(value, list)
            or len(value) not in counts
            or any(isinstance(v, bool) or not isinstance(v, int | float) or not math.isfinite(v) for v in value)
        ):
            wanted = " or ".join(map(str, counts))
            raise DatasetError(f"{self.path}: {key}: expected a list of {wanted} numbers, found {value!r:.100}")
        return tuple(float(v) for v in value)

    def mount(self) -> FloatArray:
        """(4, 4) mount in the body frame, from T_BS. Raises DatasetError."""
        block = self.keys.get("T_BS")
        if not isinstance(block, dict):
            raise DatasetError(f"{self.path}: T_BS: expected the sensor's pose in the body, with rows, cols and data")
        data = SensorFile(self.path, {"T_BS.data": block.get("data")}).numbers("T_BS.data", (16,))
        T = np.array(data).reshape(4, 4)
        if not is_rigid(T, 1e-4):
            raise DatasetError(f"{self.path}: T_BS.data is not a rigid transform")
        return T


def read_sensor_file(path: Path) -> SensorFile:
    """Read a sensor.yaml, also with the `%YAML:1.0` line of OpenCV's files.

    Raises:
        DatasetError: unreadable, too large, not YAML, not a mapping.
    """
    return SensorFile(path, read_mapping(path, "sensor description", DatasetError, "keys such as sensor_type and T_BS"))
