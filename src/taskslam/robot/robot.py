"""`Robot`: drive limits, footprint and sensor rig, validated by pydantic and read from YAML presets.

Every number's source stands beside it in the preset. A file that says `built_on: turtlebot2` gives only what differs;
`lidar_3d: null` takes a sensor off.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from taskslam.errors import RobotError
from taskslam.robot.parts import Imu, Lidar2D, Lidar3D, NonNegative, OdometryNoise, Part, Positive, StereoCamera
from taskslam.user_files import Shipped, check

_PRESETS = Shipped("robot", "taskslam.robot", "presets", RobotError)


class Drive(Part):
    """Differential drive: what the base does with a velocity command (m/s, rad/s, m/s^2, rad/s^2, s)."""

    max_linear: Positive
    max_backward: NonNegative
    max_angular: Positive
    max_linear_acceleration: Positive
    max_angular_acceleration: Positive
    command_timeout: Positive


class Footprint(Part):
    """A vertical cylinder: anything solid inside it between `ground_clearance` and `height` presses the bumper."""

    radius: Positive
    height: Positive
    ground_clearance: NonNegative


class SensorRig(Part):
    """Everything that a method may be told about the robot's sensors."""

    odometry: OdometryNoise
    lidar_2d: Lidar2D | None = None
    lidar_3d: Lidar3D | None = None
    stereo: StereoCamera | None = None
    imu: Imu | None = None


class Robot(Part):
    """A robot as the simulator, the planner and the methods see it."""

    name: str
    drive: Drive
    footprint: Footprint
    rig: SensorRig


def robot_presets() -> list[str]:
    """Names of the robots that ship with the package."""
    return _PRESETS.names()


def load_robot(name: str | Path) -> Robot:
    """A robot by preset name or from a YAML file.

    Raises:
        RobotError: no such preset or file, broken YAML, an unknown key or a value out of range, a file that is built
            on itself; says which.
    """
    content, where = _described(name, ())
    return check(Robot, content, where, RobotError)


def _described(reference: str | Path, above: tuple[str, ...]) -> tuple[dict[str, Any], str]:
    """What a robot's file and those that it is built on say, and where: as in the sentences of errors."""
    content, where = _PRESETS.read(reference, Robot)
    if "built_on" not in content:
        return content, where
    lower = content.pop("built_on")
    if not isinstance(lower, str):
        raise RobotError(f"{where}: built_on: expected the name of a robot or a .yaml file (got {lower!r:.80})")
    if lower.endswith((".yaml", ".yml")):
        lower = str(Path(reference).parent / lower)
    if lower in above:
        raise RobotError(f"{where}: built_on: {lower} is built on itself")
    under, _ = _described(lower, (*above, lower))
    return _merged(under, content), where


def _merged(under: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """`over`, and of `under` what it does not say, level by level."""
    both = {
        key: _merged(under[key], value) if isinstance(under.get(key), dict) and isinstance(value, dict) else value
        for key, value in over.items()
    }
    return under | both
