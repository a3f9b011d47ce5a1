"""`Robot`: drive limits, footprint and sensor rig, validated by pydantic and read from YAML presets.

Every number's source stands beside it in the preset. A file that says `built_on: turtlebot2` gives only what differs;
`lidar_3d: null` takes a sensor off.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

from pydantic import (
    ModelWrapValidatorHandler,
    PrivateAttr,
    SerializationInfo,
    SerializerFunctionWrapHandler,
    create_model,
    model_serializer,
    model_validator,
)

from taskslam.errors import RobotError
from taskslam.field_types import NonNegative, Positive
from taskslam.plugins import registered
from taskslam.robot.imperfections import Imperfections
from taskslam.robot.parts import Imu, Lidar2D, Lidar3D, Odometer, Part, StereoCamera
from taskslam.robot.rgbd import RgbdCamera
from taskslam.user_files import Shipped, check

SENSOR_GROUP = "taskslam.sensors"
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
    """Everything that a method may be told about the robot's sensors, their data sheets: a part each, or None.

    Parts of sensors that other packages register (`taskslam.sensors`) stand beside ours in files, under their own
    names. What a robot has not is not written: a new kind of sensor changes no other robot's bytes.
    """

    odometry: Odometer
    lidar_2d: Lidar2D | None = None
    lidar_3d: Lidar3D | None = None
    stereo: StereoCamera | None = None
    imu: Imu | None = None
    rgbd: RgbdCamera | None = None
    _outside: dict[str, Part] = PrivateAttr(default_factory=dict)

    def parts(self) -> dict[str, Part]:
        """All that it has, by name."""
        own = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: part for name, part in (own | self._outside).items() if part is not None}

    @model_validator(mode="wrap")
    @classmethod
    def _read(cls, given: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """With the parts that other packages describe."""
        unknown = given.keys() - cls.model_fields.keys() if isinstance(given, dict) else set()
        if not (names := sorted(unknown & registered(SENSOR_GROUP).keys())):
            return handler(given)
        rig = handler({name: part for name, part in given.items() if name not in names})
        for name in names:
            if given[name] is not None:
                fields: dict[str, Any] = {name: (_part_of_another(name), ...)}  # so that a fault bears its key
                described = create_model("Outside", __base__=Part, **fields).model_validate({name: given[name]})
                rig._outside[name] = getattr(described, name)
        return rig

    @model_serializer(mode="wrap")
    def _written(self, handler: SerializerFunctionWrapHandler, info: SerializationInfo) -> dict[str, Any]:
        own = {name: part for name, part in handler(self).items() if part is not None}
        return own | {name: part.model_dump(mode=info.mode) for name, part in self._outside.items()}


def _part_of_another(name: str) -> type[Part]:
    """The data sheet of a sensor that another package registers. Raises ValueError if there is none to be had."""
    point = registered(SENSOR_GROUP)[name]
    try:
        part: type[Part] = point.load().part
        if issubclass(part, Part):
            return part
    except Exception as error:
        raise ValueError(f"sensor '{name}' ({point.value}) cannot be loaded: {error}") from error
    raise ValueError(f"sensor '{name}' ({point.value}): its part is {part!r:.80}; expected a kind of Part")


class Robot(Part):
    """A robot. The planner knows drive and footprint, a method the rig, and the simulator what is wrong with it too."""

    name: str
    drive: Drive
    footprint: Footprint
    rig: SensorRig
    imperfections: Imperfections = Imperfections()

    @model_validator(mode="after")
    def _stamps_stay_in_order(self) -> Self:
        """A stamp may not come after the next one of the same sensor."""
        for name, part in self.rig.parts().items():
            jitter, rate = self.imperfections.fitting(name).jitter, getattr(part, "rate", None)
            if jitter and rate and jitter * rate >= 1.0:
                period = f"{1 / rate:g} s"
                raise ValueError(f"imperfections.{name}.jitter: {jitter:g} s; expected less than a period, {period}")
        return self


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
    _refuse_imperfections_in(content.get("rig"), where)
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


def _refuse_imperfections_in(rig: object, where: str) -> None:
    """What a run draws stood on the data sheets once, where methods could read it."""
    for name, part in rig.items() if isinstance(rig, dict) else ():
        for key in part if isinstance(part, dict) else ():
            if Imperfections.holds(name, key):
                raise RobotError(
                    f"{where}: rig.{name}.{key}: expected under imperfections.{name}.{key}: methods are told the rig"
                )


def _merged(under: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """`over`, and of `under` what it does not say, level by level."""
    both = {
        key: _merged(under[key], value) if isinstance(under.get(key), dict) and isinstance(value, dict) else value
        for key, value in over.items()
    }
    return under | both
