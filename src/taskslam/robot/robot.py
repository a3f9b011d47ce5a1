"""`Robot`: drive limits, footprint and sensor rig, validated by pydantic and read from YAML presets.

Mounts are poses of the sensor in `base` (REP-105 base_link projected to the floor: x forward, y left, z up,
origin on the floor between the wheels). Every number's source stands beside it in the preset. A file that says
`built_on: turtlebot2` gives only what differs; `lidar_3d: null` takes a sensor off.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from taskslam.errors import RobotError
from taskslam.geometry import FloatArray, pose_from_xyz_rpy
from taskslam.user_files import Shipped, check

_PRESETS = Shipped("robot", "taskslam.robot", "presets", RobotError)

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Vector3 = tuple[float, float, float]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Mount(_Part):
    """Where a sensor sits: pose of the sensor frame in `base`."""

    xyz: Vector3
    rpy: Vector3 = (0.0, 0.0, 0.0)

    def matrix(self) -> FloatArray:
        """(4, 4) `T_base_sensor`."""
        return pose_from_xyz_rpy(self.xyz, self.rpy)


class Drive(_Part):
    """Differential drive: what the base does with a velocity command (m/s, rad/s, m/s^2, rad/s^2, s)."""

    max_linear: Positive
    max_backward: NonNegative
    max_angular: Positive
    max_linear_acceleration: Positive
    max_angular_acceleration: Positive
    command_timeout: Positive


class Footprint(_Part):
    """A vertical cylinder: anything solid inside it between `ground_clearance` and `height` presses the bumper."""

    radius: Positive
    height: Positive
    ground_clearance: NonNegative


class Lidar2D(_Part):
    """A planar LiDAR; ray i points along angle_min + i * (angle_max - angle_min) / (samples - 1)."""

    mount: Mount
    rate: Positive
    samples: Annotated[int, Field(ge=2)]
    angle_min: float
    angle_max: float
    range_min: NonNegative
    range_max: Positive
    resolution: NonNegative = 0.0
    noise: NonNegative
    rolling: bool = False

    @property
    def angle_increment(self) -> float:
        """Angle between neighbouring rays, radians."""
        return (self.angle_max - self.angle_min) / (self.samples - 1)

    def angles(self) -> FloatArray:
        """(samples,) ray directions in the laser frame, radians."""
        return self.angle_min + self.angle_increment * np.arange(self.samples, dtype=np.float64)


class OdometryNoise(_Part):
    """Gyro-integrated wheel odometry (protocol 4.6): encoders give distance, the gyro gives heading.

    gyro_noise: standard deviation of one gyro sample at `gyro_rate`, rad/s; gyro_bias: standard deviation of the bias
    that each run draws once, rad/s; scale: systematic relative distance error; slip: relative random distance error
    per square root of a metre; rate: Hz of the published odometry.
    """

    rate: Positive
    gyro_rate: Positive
    gyro_noise: NonNegative
    gyro_bias: NonNegative
    scale: float = 0.0
    slip: NonNegative = 0.0


class Lidar3D(_Part):
    """A spinning LiDAR: `rings` evenly over the elevations, `samples` per ring over 360 degrees (protocol 4.4).

    rolling: every firing sees the world from where the robot is at its own time; else the whole turn is one instant.
    """

    mount: Mount
    rate: Positive
    rings: Annotated[int, Field(ge=1, le=256)]
    samples: Annotated[int, Field(ge=2)]
    elevation_min: float
    elevation_max: float
    range_min: NonNegative
    range_max: Positive
    noise: NonNegative
    rolling: bool = False


class StereoCamera(_Part):
    """A rectified pinhole pair without distortion (protocol 4.3).

    mount: pose of the left camera's body frame (x forward, y left, z up) in `base`; the right camera stands `baseline`
    metres to its right. horizontal_fov: radians, gives fx = fy. noise: standard deviation of the read noise in grey
    levels of 0..255. color: RGB images instead of grey ones. exposure: `auto`, or a fixed gain.
    """

    mount: Mount
    rate: Positive
    width: Annotated[int, Field(ge=16, le=8192)]
    height: Annotated[int, Field(ge=16, le=8192)]
    horizontal_fov: Annotated[float, Field(gt=0, lt=3.1)]
    baseline: Positive
    noise: NonNegative
    near: Positive = 0.05
    far: Positive = 50.0
    color: bool = False
    exposure: Literal["auto"] | Positive = "auto"

    @property
    def focal_length(self) -> float:
        """Fx = fy in pixels."""
        return 0.5 * self.width / math.tan(0.5 * self.horizontal_fov)

    @property
    def center(self) -> tuple[float, float]:
        """Principal point cx, cy in pixels, OpenCV's convention (a pixel's centre has whole coordinates)."""
        return 0.5 * self.width, 0.5 * self.height


class Imu(_Part):
    """A six-axis IMU (protocol 4.5). Noises are per-sample standard deviations, biases are drawn once per run.

    gyro_noise, gyro_bias: rad/s; accel_noise, accel_bias: m/s^2.
    """

    mount: Mount
    rate: Positive
    gyro_noise: NonNegative
    gyro_bias: NonNegative
    accel_noise: NonNegative
    accel_bias: NonNegative


class SensorRig(_Part):
    """Everything that a method may be told about the robot's sensors."""

    odometry: OdometryNoise
    lidar_2d: Lidar2D | None = None
    lidar_3d: Lidar3D | None = None
    stereo: StereoCamera | None = None
    imu: Imu | None = None


class Robot(_Part):
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
