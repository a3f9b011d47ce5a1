"""What a simulated sensor is, and what it may look at."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

from taskslam.measurements import Measurement, Sensor
from taskslam.robot import Imperfections, SensorRig
from taskslam.sensors import SensorKind, found_at
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.world import World


class SimulatedSensor(Protocol):
    """What the simulator asks of a sensor. rate: Hz."""

    sensor: Sensor
    rate: float

    def reset(self, count: int) -> None:
        """Fresh noise after the count-th reset."""

    def measure(self, stamp: int, motion: Motion) -> Measurement:
        """The measurement that is complete at `stamp` (ns)."""


@dataclass(frozen=True)
class Surroundings:
    """The world that a sensor senses, the seed of its noise (`streams.py`), and what is wrong with the robot.

    lidar_geometry: `visual` as Gazebo's GPU ray sensor, `collision` as its CPU one.
    """

    world: World
    seed: int
    lidar_geometry: str = "visual"
    imperfections: Imperfections = field(default_factory=Imperfections)

    @cached_property
    def rays(self) -> RayCaster:
        """What LiDARs meet, made once for all of them."""
        return RayCaster(self.world.visual if self.lidar_geometry == "visual" else self.world.collision)


def simulated(kind: SensorKind, rig: SensorRig, surroundings: Surroundings) -> SimulatedSensor:
    """The device of a sensor that the rig has: what the table's `device` makes of its part, ready to measure."""
    device: SimulatedSensor = found_at(kind.device)(kind.part_of(rig), surroundings)
    device.reset(0)
    return device
