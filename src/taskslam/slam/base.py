"""`SlamMethod`: what a SLAM method must be able to do here, and `MethodCard`: what it declares about itself.

A complete method:

    class MyMethod(SlamMethod):
        card = MethodCard(name="mine", version="1", licence="MIT", kind=Kind.SLAM, sensors=(Sensor.LASER_SCAN,))

        def start(self, rig):
            self.T_start_base = np.eye(4)

        def feed(self, measurement):
            ...
            return PoseEstimate(measurement.stamp, self.T_start_base, Status.TRACKING)

It runs in a child process of its own and only ever sees the measurements that its card asks for.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Collection
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import ClassVar

from taskslam.geometry import FloatArray
from taskslam.measurements import Measurement, Sensor
from taskslam.robot import SensorRig


class InvalidOutputError(Exception):
    """What a method returns, or what something foreign that it wraps has said, is no pose."""


class StalledError(Exception):
    """Something foreign that a method wraps no longer answers."""


class Kind(StrEnum):
    """What a method is: with loop closure and map, dead reckoning, in a given map, or told the truth."""

    SLAM = "slam"
    ODOMETRY = "odometry"
    LOCALIZATION = "localization"
    REFERENCE = "reference"


class MapMode(StrEnum):
    """What a method does with its map in with-map rounds (protocol 7.3 #13)."""

    CONTINUE = "continue"
    FROZEN = "frozen"
    NONE = "none"


class Status(StrEnum):
    """How sure a method is of its live pose."""

    STARTING = "starting"
    TRACKING = "tracking"
    LOST = "lost"


@dataclass(frozen=True, slots=True)
class MethodCard:
    """What a method declares; printed beside every result.

    sensors: measurements it must get. optional_sensors: those that it makes use of where the robot, or a recording, has
    them. odometry_prior: whether wheel odometry is used to predict (it must then be among these). needs_still_start:
    seconds of standstill before the first drive. latency: seconds from a frame's stamp to the delivery of its estimate
    in `fixed` mode; None: nobody has measured it, none is added, and every run says so. queue: frames kept while the
    method is busy (1: the newest wins).
    extra: the pip extra that brings its package, or None. What a method needs beyond the wall around it
    (docs/decisions/004) is printed beside its results. reads: files and folders that it reads, by whole paths;
    loopback: it talks over TCP with processes of its own; shared_memory: it needs a /dev/shm, as multiprocessing does.
    """

    name: str
    version: str
    licence: str
    kind: Kind
    sensors: tuple[Sensor, ...]
    summary: str = ""
    odometry_prior: bool = False
    needs_still_start: float = 0.0
    map_mode: MapMode = MapMode.NONE
    can_save_map: bool = False
    deterministic: bool = True
    asynchronous: bool = False
    latency: float | None = None
    queue: int = 1
    homepage: str = ""
    extra: str | None = None
    reads: tuple[str, ...] = ()
    loopback: bool = False
    shared_memory: bool = False
    optional_sensors: tuple[Sensor, ...] = ()

    def hears(self, has: Collection[Sensor]) -> tuple[Sensor, ...]:
        """What it is fed by a robot that has these sensors: all that it must get, and of the optional ones those."""
        return (*self.sensors, *(sensor for sensor in self.optional_sensors if sensor in has))


@dataclass(frozen=True, slots=True)
class PoseEstimate:
    """A live pose: `T_start_base`, (4, 4), the base in the frame in which the base started.

    stamp: ns, the measurement's instant that this pose belongs to. covariance: (3, 3) over x, y, theta in the base's
    start frame, m^2 and rad^2, or None.
    """

    stamp: int
    T_start_base: FloatArray
    status: Status
    covariance: FloatArray | None = None


class SlamMethod(ABC):
    """A SLAM method. Constructed with its options as keyword arguments; then start, feed..., stop."""

    card: ClassVar[MethodCard]

    @abstractmethod
    def start(self, rig: SensorRig) -> None:
        """Begin from nothing at the pose where the robot stands: that pose is the origin of `T_start_base`."""

    @abstractmethod
    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """Take one measurement, in stamp order; return the live pose, or None if there is nothing new."""

    def save_map(self, path: Path) -> None:
        """Write the map to a file. Only if `card.can_save_map`."""
        raise NotImplementedError(f"{self.card.name} cannot save a map")

    def load_map(self, path: Path) -> None:
        """Read a map written by `save_map`; call after `start`, with the robot at the map's start pose."""
        raise NotImplementedError(f"{self.card.name} cannot load a map")

    def processor_time(self) -> int:
        """Processor time used so far, ns: this process's, and that of others which it has work for it."""
        return time.process_time_ns()

    def stop(self) -> None:
        """Release what was taken. Called once; the process ends soon after."""
        return
