"""Driving a scenario in the simulator and writing what the sensors said as a dataset of a form that the field reads.

The drive is one round of the closed loop, steered by any method of the registry. Beside the dataset, in `drive/`,
stands the run directory of that round: what a replay of the dataset can be compared with.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

from taskslam.benchmark.protocol import Tour, drive_tour
from taskslam.benchmark.run import Undertaking, build_simulator, record_tour
from taskslam.benchmark.simulated_platform import SimulatedPlatform
from taskslam.benchmark.stage import Stage
from taskslam.datasets.bag_writer import BagWriter
from taskslam.datasets.euroc_writer import EUROC_SENSORS, EurocWriter
from taskslam.errors import DatasetError
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, Measurement, Sensor, WheelOdometry
from taskslam.observer import Observer
from taskslam.record.events import RunEnded
from taskslam.record.place import whole_folder
from taskslam.robot import SensorRig
from taskslam.sensors import fitted
from taskslam.simulation.simulator import Simulator
from taskslam.slam.cards import card_of
from taskslam.slam.guest.latency import LatencyModel
from taskslam.task import Mode, Sequence

DRIVE = "drive"


class Format(StrEnum):
    """What is written."""

    EUROC = "euroc"
    ROSBAG1 = "rosbag1"
    ROSBAG2 = "rosbag2"
    MCAP = "mcap"


@dataclass(frozen=True)
class ExportRequest:
    """What to record. sensors: None for all that robot and format have; goals, seconds: where to stop early."""

    format: Format
    sensors: frozenset[Sensor] | None = None
    method: str = "ground_truth"
    seed: int = 0
    goals: int | None = None
    seconds: float | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    latency: LatencyModel = field(default_factory=LatencyModel)


class DatasetWriter(Protocol):
    """What each format's writer can do."""

    def measurement(self, measurement: Measurement) -> None:
        """Write one measurement."""

    def truth(self, stamp: int, pose: SE2) -> None:
        """Write the true pose of an instant (ns), in `map`."""

    def close(self) -> None:
        """Finish the files."""


class _EnoughError(Exception):
    """The time that was asked for is over."""


class _Recorded(SimulatedPlatform):
    """The simulator, with a writer that hears what its sensors say until `until` (ns)."""

    def __init__(
        self, build: Callable[[], Simulator], writer: DatasetWriter, wanted: frozenset[Sensor], until: int | None
    ) -> None:
        super().__init__(build)
        self._writer = writer
        self._wanted = wanted
        self._until = until

    def advance(self, until: int) -> Iterator[Measurement]:
        """As the simulator's. Raises _EnoughError at the first measurement that is too late to be recorded."""
        for measurement in super().advance(until):
            if self._until is not None and measurement.stamp > self._until:
                raise _EnoughError
            if measurement.sensor in self._wanted:
                self._writer.measurement(measurement)
            if isinstance(measurement, WheelOdometry):
                self._writer.truth(measurement.stamp, self.true_pose())
            yield measurement


def export(stage: Stage, request: ExportRequest, out: Path, observer: Observer | None = None) -> bool:
    """Drive one round and write it to the new folder `out`, whole or not at all; whether every goal was reached.

    Raises:
        DatasetError: `out` exists, the robot lacks a sensor, or the format cannot hold it.
        ScenarioError, UnknownMethodError, MethodUnavailableError, InputError, InfrastructureError: as for a run.
    """
    observer = observer or Observer()
    out = out.absolute()
    if out.exists():
        raise DatasetError(f"{out}: exists already; expected the name of a new folder")
    stage = _shortened(stage, request.goals)
    sensors = _sensors(stage.robot.rig, request)
    spec = stage.spec(request.method, Mode.WITHOUT_MAP, request.seed, request.options, request.latency)
    card = card_of(spec.method)
    heard = sensors | set(card.hears(fitted(stage.robot.rig)))
    until = None if request.seconds is None else round(request.seconds * NANOSECONDS)
    with whole_folder(out) as folder, closing(_writer(request.format, folder, stage, sensors)) as writer:
        platform = _Recorded(lambda: build_simulator(stage, spec.seed, heard), writer, sensors, until)
        undertaking = Undertaking(stage, spec, card)
        return record_tour(undertaking, platform, folder / DRIVE, observer, drive=_drive_until_enough)


def _drive_until_enough(tour: Tour, mode: Mode) -> bool:
    """As `drive_tour`, but the asked for seconds may end the run: then not every goal was reached."""
    try:
        return drive_tour(tour, mode)
    except _EnoughError:
        tour.last_failure = "the export ended here, as asked"
        tour.record.event(RunEnded(tour.platform.now, False))
        return False


def _shortened(stage: Stage, goals: int | None) -> Stage:
    """The stage with one round over the first so many goals."""
    scenario = stage.scenario
    sequence = Sequence(waypoints=scenario.sequence.goals[:goals])
    protocol = scenario.protocol.model_copy(update={"rounds": 1})
    return replace(stage, scenario=scenario.model_copy(update={"sequence": sequence, "protocol": protocol}))


def _sensors(rig: SensorRig, request: ExportRequest) -> frozenset[Sensor]:
    """The sensors to record: those asked for, or all that the robot has and the format can hold."""
    kinds = fitted(rig)
    has = frozenset(kinds)
    if request.sensors is None:
        in_bags = frozenset(sensor for sensor, kind in kinds.items() if kind.bag)
        return has & EUROC_SENSORS if request.format is Format.EUROC else in_bags
    if missing := sorted(request.sensors - has):
        raise DatasetError(f"the robot has no {', '.join(missing)}; it has {', '.join(sorted(has))}")
    return request.sensors


def _writer(form: Format, folder: Path, stage: Stage, sensors: frozenset[Sensor]) -> DatasetWriter:
    if form is Format.EUROC:
        return EurocWriter(folder, stage.robot, sensors)
    return BagWriter(folder, stage.scenario.name, form.value, stage.robot, sensors)
