"""`Dataset`: what the sensors of one recorded drive said, whoever recorded it, streamed in stamp order.

A reader never holds more than a few measurements: a recording may be larger than the memory.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from taskslam.geometry import FloatArray
from taskslam.measurements import Measurement, Sensor
from taskslam.reading import is_file
from taskslam.robot import SensorRig
from taskslam.sensors import sensor_kind
from taskslam.skipped import Skipped


@dataclass(frozen=True, slots=True)
class TruthPose:
    """The recorded ground truth at an instant (ns): (4, 4) `T_world_base`."""

    stamp: int
    T_world_base: FloatArray


class Dataset(ABC):
    """One recording. Use as a context manager.

    path: where it lies; name: for results, that of the folder or file that was given; kind: `euroc` or `bag`; rig: its
    sensors with their calibration; sensors: those that it holds and that can be used; why_not: for others, a sentence
    that says why they cannot; skipped: what was left out while reading, by a word for it.
    """

    kind: str
    rig: SensorRig
    sensors: frozenset[Sensor]

    def __init__(self, path: Path) -> None:
        self.path = path
        self.name = path.stem if is_file(path) else path.resolve().name
        self.why_not: dict[Sensor, str] = {}
        self.skipped = Skipped()
        self.notes: list[str] = []

    @abstractmethod
    def measurements(self, sensors: Collection[Sensor]) -> Iterator[Measurement]:
        """What these sensors said, in stamp order, from the beginning; see `order` for equal stamps.

        What cannot be read is skipped and counted. Raises DatasetError naming file and place where it is too much.
        """

    @abstractmethod
    def truth(self) -> Iterator[TruthPose]:
        """The ground truth in stamp order; nothing if there is none. Raises DatasetError."""

    def close(self) -> None:
        """Release files. May be called more than once."""
        return

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        self.close()


def order(measurement: Measurement) -> tuple[int, int]:
    """Sort key: by stamp; among equals odometry first, then IMU, scans, clouds, images, as the simulator has it."""
    return measurement.stamp, sensor_kind(measurement.sensor).rank
