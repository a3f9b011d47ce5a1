"""`BagSensor`: how one kind of sensor is written into bags and read from them. The table of sensors names each."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Protocol

from taskslam.datasets.ros_encoding import RosEncoder, Said
from taskslam.geometry import FloatArray
from taskslam.measurements import Measurement
from taskslam.robot import SensorRig
from taskslam.sensors import SensorKind, fitted, found_at, sensor_kind

if TYPE_CHECKING:
    from taskslam.datasets.bag_rig import Frames
    from taskslam.datasets.stamp_order import Pairing


class Recording(Protocol):
    """What a sensor may look at to tell its part of the rig: topics of its roles, first messages, where frames are."""

    @property
    def frames(self) -> Frames:
        """Static transforms and mounts that the user gives."""

    def topic(self, role: str) -> str:
        """The topic that was chosen for a role."""

    def first(self, topic: str) -> list[Any]:
        """The first messages of a topic. Raises DatasetError where there is none."""

    def has(self, topic: str) -> bool:
        """Whether the recording has such a topic."""

    def note(self, sentence: str) -> None:
        """Say what was guessed, or not believed, of it."""


class BagSensor(ABC):
    """A sensor of one recording that is read. part: its data sheet, as given or as the first messages tell it."""

    part: Any

    @abstractmethod
    def __init__(self, recording: Recording, given: Any) -> None:
        """Find the part; given: that of the robot, or None.

        Raises:
            DatasetError, ValidationError: it cannot be told.
        """

    @staticmethod
    @abstractmethod
    def frames(part: Any) -> list[tuple[str, FloatArray]]:
        """Frames that our export gives to a part, each with its (4, 4) pose in the base."""

    @staticmethod
    @abstractmethod
    def messages(encoder: RosEncoder, part: Any, measurement: Any) -> Iterator[Said]:
        """The messages that carry one measurement, on the topics of the table."""

    @abstractmethod
    def measurement(self, role: str, content: Any, pairing: Pairing) -> Measurement | None:
        """What a message of a role says, if it completes a measurement. pairing: of this pass, for several images.

        Raises DatasetError without saying where.
        """


def bag_sensor(kind: SensorKind) -> type[BagSensor]:
    """What the table names."""
    found: type[BagSensor] = found_at(kind.bag)
    return found


def frames_of(rig: SensorRig) -> list[tuple[str, FloatArray]]:
    """Frames that our export gives to the sensors of a rig, each with its (4, 4) pose in the base."""
    kinds = [kind for kind in fitted(rig).values() if kind.bag]
    return [frame for kind in kinds for frame in bag_sensor(kind).frames(kind.part_of(rig))]


def messages_of(encoder: RosEncoder, rig: SensorRig, measurement: Measurement) -> Iterator[Said]:
    """The messages that carry one measurement of a robot with this rig."""
    kind = sensor_kind(measurement.sensor)
    return bag_sensor(kind).messages(encoder, kind.part_of(rig), measurement)
