"""What a simulated sensor is, and what it may look at."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

from taskslam.measurements import Measurement, Sensor
from taskslam.robot import Imperfections, SensorRig
from taskslam.robot.imperfections import LidarImperfections
from taskslam.sensors import SensorKind, found_at
from taskslam.simulation.fitting import truly_mounted
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.faint_rays import FaintRays
from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.world import TriangleMesh, World


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
        return RayCaster(self._met)

    def rays_of(self, wrong: LidarImperfections | None) -> RayCaster | FaintRays:
        """The same for a LiDAR that is not perfect."""
        if wrong is None or (wrong.reach_dark is None and wrong.glass_angle is None):
            return self.rays
        return FaintRays(self.world, self._met, self.rays, wrong)

    @property
    def _met(self) -> TriangleMesh:
        return self.world.visual if self.lidar_geometry == "visual" else self.world.collision


def simulated(kind: SensorKind, rig: SensorRig, surroundings: Surroundings) -> SimulatedSensor:
    """The device of a sensor that the rig has: what the table's `device` makes of its part where it truly sits.

    It is ready to measure.
    """
    fitting = surroundings.imperfections.fitting(kind.field)
    part = truly_mounted(kind.part_of(rig), fitting, surroundings.seed, kind.field)
    device: SimulatedSensor = found_at(kind.device)(part, surroundings)
    device.reset(0)
    return device
