"""One second of every sensor of a small robot in the room, and the datasets that are written of it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import pytest

from taskslam.benchmark.run import run
from taskslam.benchmark.stage import Stage
from taskslam.datasets.bag_writer import BagWriter
from taskslam.datasets.euroc_writer import EUROC_SENSORS, EurocWriter
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, Measurement, Sensor, WheelOdometry
from taskslam.mode import Mode
from taskslam.record import RunRecord, load_run
from taskslam.robot import Robot, load_robot
from taskslam.scenario import Scenario
from taskslam.sensors import fitted
from taskslam.simulation.simulator import Simulator
from taskslam.world import World
from taskslam.world.slicing import slice_floor_plan

SENSORS = frozenset(fitted(load_robot("turtlebot2_d435i").rig))


@dataclass(frozen=True)
class Recorded:
    """What the sensors of a robot said on a short drive, and where it truly was (stamp, pose in `map`)."""

    robot: Robot
    measurements: list[Measurement]
    truth: list[tuple[int, SE2]]

    def of(self, sensors: frozenset[Sensor]) -> list[Measurement]:
        return [measurement for measurement in self.measurements if measurement.sensor in sensors]


def small_robot() -> Robot:
    """turtlebot2 with small images and few rays, and the RGB-D camera of the real one."""
    robot = load_robot("turtlebot2")
    rig = robot.rig
    rgbd = load_robot("turtlebot2_d435i").rig.rgbd
    return robot.model_copy(
        update={
            "rig": rig.model_copy(
                update={
                    "stereo": rig.stereo.model_copy(update={"width": 96, "height": 64}),
                    "rgbd": rgbd.model_copy(update={"width": 80, "height": 60, "rate": 20.0}),
                    "lidar_2d": rig.lidar_2d.model_copy(update={"samples": 180}),
                    "lidar_3d": rig.lidar_3d.model_copy(update={"rings": 4, "samples": 60}),
                }
            )
        }
    )


@pytest.fixture(scope="session")
def recorded(room: World) -> Recorded:
    """A curve of one second through the room."""
    robot = small_robot()
    simulator = Simulator(room, robot, 3, sensors=SENSORS)
    simulator.reset(SE2(-1.0, 0.3, 0.4))
    simulator.drive(0.3, 0.8)
    measurements, truth = [], []
    for measurement in simulator.advance(NANOSECONDS):
        measurements.append(measurement)
        if isinstance(measurement, WheelOdometry):
            truth.append((measurement.stamp, simulator.true_pose()))
    return Recorded(robot, measurements, truth)


def _write(writer: EurocWriter | BagWriter, recorded: Recorded, sensors: frozenset[Sensor]) -> None:
    poses = dict(recorded.truth)
    for measurement in recorded.of(sensors | {Sensor.WHEEL_ODOMETRY}):
        if measurement.sensor in sensors:
            writer.measurement(measurement)
        if isinstance(measurement, WheelOdometry):
            writer.truth(measurement.stamp, poses[measurement.stamp])
    writer.close()


@pytest.fixture
def euroc(tmp_path: Path, recorded: Recorded) -> Path:
    """The drive as an EuRoC folder, to be damaged at will."""
    folder = tmp_path / "euroc"
    folder.mkdir()
    _write(EurocWriter(folder, recorded.robot, EUROC_SENSORS), recorded, EUROC_SENSORS)
    return folder


@pytest.fixture(scope="session", params=["rosbag1", "rosbag2", "mcap"])
def bag(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, recorded: Recorded) -> Path:
    """The drive as a bag of each kind; not to be changed."""
    folder = tmp_path_factory.mktemp(request.param)
    _write(BagWriter(folder, "drive", request.param, recorded.robot, SENSORS), recorded, SENSORS)
    return next(place for place in folder.iterdir())


def same(one: Measurement, other: Measurement) -> bool:
    """Whether two measurements are the same bit for bit."""
    return one.sensor == other.sensor and all(
        _same_value(getattr(one, field.name), getattr(other, field.name)) for field in fields(one)
    )


def _same_value(one: object, other: object) -> bool:
    if isinstance(one, np.ndarray):
        return isinstance(other, np.ndarray) and one.dtype == other.dtype and np.array_equal(one, other)
    return one == other


@pytest.fixture(scope="session")
def is_same():
    return same


@pytest.fixture(scope="session")
def driven(room: World, tmp_path_factory: pytest.TempPathFactory) -> dict[str, RunRecord]:
    """A run in each mode: three goals in the room by wheel odometry, two rounds that count."""
    goals = [[-1.0, -1.0, 0.0], [0.4, -1.6, 0.6], [-1.6, 0.4, 2.5]]
    scenario = Scenario.model_validate(
        {
            "name": "room",
            "world": {"name": "house"},
            "start": {"x": -2.0, "y": -1.0, "theta": 0.0},
            "sequence": {"waypoints": goals},
            "protocol": {"rounds": 2, "pause": 0.5, "still_start": 0.5},
        }
    )
    plan = slice_floor_plan(room, 0.02, 0.45, 0.05, seed_point=(-2.0, -1.0))
    stage = Stage(scenario, room, plan, load_robot("turtlebot2"))
    out = tmp_path_factory.mktemp("driven")
    return {mode.value: load_run(run(stage, stage.spec("wheel_odometry", mode), out)[0]) for mode in Mode}
