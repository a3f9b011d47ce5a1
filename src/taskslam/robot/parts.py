"""The parts of a robot that sense: where each sits and what its maker says of it, validated by pydantic.

Mounts are poses of the sensor in `base` (REP-105 base_link projected to the floor: x forward, y left, z up, origin on
the floor between the wheels).
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, SerializerFunctionWrapHandler, model_serializer

from taskslam.field_types import NonNegative, Positive
from taskslam.geometry import FloatArray, pose_from_xyz_rpy

Rate = Annotated[float, Field(gt=0, le=100_000)]  # Hz
Vector3 = tuple[float, float, float]


class Part(BaseModel):
    """Anything that a robot is made of: frozen, and no key unknown."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def image_bytes(self) -> tuple[int, ...]:
        """Bytes of each image of one measurement, which then travel in shared memory; none for what takes no images."""
        return ()


class SparsePart(Part):
    """A part that does not write those of its fields that are None: a new one changes no other robot's bytes."""

    @model_serializer(mode="wrap")
    def _written(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {name: value for name, value in handler(self).items() if value is not None}


class Mount(Part):
    """Where a sensor sits: pose of the sensor frame in `base`."""

    xyz: Vector3
    rpy: Vector3 = (0.0, 0.0, 0.0)

    def matrix(self) -> FloatArray:
        """(4, 4) `T_base_sensor`."""
        return pose_from_xyz_rpy(self.xyz, self.rpy)


class Lidar2D(Part):
    """A planar LiDAR; ray i points along angle_min + i * (angle_max - angle_min) / (samples - 1)."""

    mount: Mount
    rate: Rate
    samples: Annotated[int, Field(ge=2, le=100_000)]
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


class Odometer(Part):
    """Gyro-integrated wheel odometry (protocol 4.6): encoders give distance, the gyro gives heading.

    rate: Hz of the published odometry; gyro_noise: standard deviation of one gyro sample at `gyro_rate`, rad/s.
    """

    rate: Rate
    gyro_rate: Rate
    gyro_noise: NonNegative


class Lidar3D(Part):
    """A spinning LiDAR: `rings` evenly over the elevations, `samples` per ring over 360 degrees (protocol 4.4).

    rolling: every firing sees the world from where the robot is at its own time; else the whole turn is one instant.
    """

    mount: Mount
    rate: Rate
    rings: Annotated[int, Field(ge=1, le=256)]
    samples: Annotated[int, Field(ge=2, le=100_000)]
    elevation_min: float
    elevation_max: float
    range_min: NonNegative
    range_max: Positive
    noise: NonNegative
    rolling: bool = False


class Camera(SparsePart):
    """A pinhole without distortion, and one beside it (protocol 4.3).

    mount: pose of its body frame (x forward, y left, z up) in `base`; the other stands `baseline` metres to its right.
    horizontal_fov: radians, gives fx = fy. noise: standard deviation of the read noise in grey levels of 0..255. near,
    far: what is seen at all, metres. color: RGB images instead of grey ones. exposure: `auto`, or a fixed gain.
    readout: of a rolling shutter, seconds from the first row to the last; None: all rows at once.
    """

    mount: Mount
    rate: Rate
    width: Annotated[int, Field(ge=16, le=8192)]
    height: Annotated[int, Field(ge=16, le=8192)]
    horizontal_fov: Annotated[float, Field(gt=0, lt=3.1)]
    baseline: Positive
    noise: NonNegative
    near: Positive = 0.05
    far: Positive = 50.0
    color: bool = False
    exposure: Literal["auto"] | Positive = "auto"
    readout: Annotated[float, Field(gt=0, le=0.1)] | None = None

    @property
    def focal_length(self) -> float:
        """Fx = fy in pixels."""
        return 0.5 * self.width / math.tan(0.5 * self.horizontal_fov)

    @property
    def center(self) -> tuple[float, float]:
        """Principal point cx, cy in pixels, OpenCV's convention (a pixel's centre has whole coordinates)."""
        return 0.5 * self.width, 0.5 * self.height

    @property
    def image_shape(self) -> tuple[int, ...]:
        """(height, width), and 3 in colour."""
        return (self.height, self.width, 3)[: 3 if self.color else 2]


class StereoCamera(Camera):
    """A rectified pair; the mount is the left camera's."""

    def image_bytes(self) -> tuple[int, ...]:
        """Left and right."""
        return (math.prod(self.image_shape),) * 2


class Imu(Part):
    """A six-axis IMU (protocol 4.5). gyro_noise, accel_noise: standard deviation of one sample, rad/s and m/s^2."""

    mount: Mount
    rate: Rate
    gyro_noise: NonNegative
    accel_noise: NonNegative
