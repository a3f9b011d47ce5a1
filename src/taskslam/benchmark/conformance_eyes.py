"""What cameras see on the conformance drive: its room, papered and furnished, through the simulator's own sensors.

The drive itself (`slam/conformance/drive.py`) is made from numpy alone and renders nothing; whoever checks a method
that has eyes, or hears a sensor of another package, hands it these.
"""

from __future__ import annotations

from collections.abc import Collection

from taskslam.errors import InputError
from taskslam.geometry import SE2, pose_from_xyz_rpy
from taskslam.measurements import Measurement, Sensor
from taskslam.robot import SensorRig
from taskslam.sensors import fitted
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.simulated_sensor import SimulatedSensor, Surroundings, simulated
from taskslam.slam.conformance.drive import Look
from taskslam.slam.conformance.room import HANGING, STANDING
from taskslam.world import World
from taskslam.world.builtin.builder import Builder
from taskslam.world.builtin.palettes import HousePalette
from taskslam.world.world import Light

_SEED = 5


def conformance_looks(rig: SensorRig, sensors: Collection[Sensor]) -> dict[Sensor, Look]:
    """Simulated sensors of the rig in the room of the conformance drive. Raises InputError for one it has not."""
    has = fitted(rig)
    if missing := sorted(set(sensors) - has.keys()):
        raise InputError(f"the robot has no {', '.join(missing)}; it has {', '.join(sorted(has))}")
    surroundings = Surroundings(conformance_world(), _SEED)
    by_rank = sorted((has[sensor] for sensor in set(sensors)), key=lambda kind: (kind.rank, kind.sensor))
    return {kind.sensor: _look(simulated(kind, rig, surroundings)) for kind in by_rank}


def _look(device: SimulatedSensor) -> Look:
    """What the device sees; a stamp that is not after the last one begins the drive again, with the same noise."""
    last = -1

    def look(stamp: int, T_room_base: SE2) -> Measurement:
        nonlocal last
        if stamp <= last:
            device.reset(0)
        last = stamp
        return device.measure(stamp, Motion(stamp, T_room_base))

    return look


def conformance_world() -> World:
    """The room of `conformance_room.py` with bricks, wood and pictures on it; its frame is the room's."""
    b = Builder(_SEED)
    p = HousePalette(b, _SEED)
    (x0, y0, x1, y1, height), *standing = STANDING
    wide, deep = x1 - x0, y1 - y0
    with b.model("room"):
        b.panel((x0, y0, 0.0), (wide, 0.0, 0.0), (0.0, deep, 0.0), p.oak_floor)
        b.panel((x0, y1, height), (wide, 0.0, 0.0), (0.0, -deep, 0.0), p.ceiling)
        b.panel((x0, y0, 0.0), (0.0, deep, 0.0), (0.0, 0.0, height), p.brick)
        b.panel((x1, y1, 0.0), (0.0, -deep, 0.0), (0.0, 0.0, height), p.brick)
        b.panel((x1, y0, 0.0), (-wide, 0.0, 0.0), (0.0, 0.0, height), p.kids_wall)
        b.panel((x0, y1, 0.0), (wide, 0.0, 0.0), (0.0, 0.0, height), p.bedroom_wall)
    woods = (p.walnut_floor, p.kitchen_floor, p.splashback, p.brick)
    for index, (left, front, right, back, top) in enumerate(standing):
        with b.model(f"standing {index}"):
            b.box((left, front, 0.0), (right, back, top), woods[index % len(woods)])
    for index, (left, front, right, back, bottom, top) in enumerate(HANGING):
        with b.model(f"hanging {index}"):
            b.box((left, front, bottom), (right, back, top), p.painting(right - left, top - bottom))
    lamp = Light(
        name="lamp",
        type="point",
        pose=pose_from_xyz_rpy((0.0, 0.0, height - 0.2), (0.0, 0.0, 0.0)),
        diffuse=(0.7, 0.7, 0.66),
        attenuation_range=12.0,
        attenuation=(0.6, 0.08, 0.02),
    )
    return b.world("conformance room", (lamp,), ambient=(0.5, 0.5, 0.5), background=(0.7, 0.8, 0.9))
