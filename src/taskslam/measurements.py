"""What sensors say. Values only: frozen, stamped in integer nanoseconds of simulated (or recorded) time.

A measurement never says who made it, and never carries a true pose, except `TruePose`, which only a method whose
card says `reference` is ever given.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from taskslam.geometry import SE2

NANOSECONDS = 1_000_000_000


class Sensor(str):
    """The name of a kind of measurement, as a method's card asks for it.

    Ours are constants here (`Sensor.LASER_SCAN`); a package may add others (`taskslam.sensors`).
    """

    __slots__ = ()
    LASER_SCAN: ClassVar[Sensor]
    POINT_CLOUD: ClassVar[Sensor]
    STEREO_IMAGES: ClassVar[Sensor]
    RGBD_IMAGES: ClassVar[Sensor]
    IMU: ClassVar[Sensor]
    WHEEL_ODOMETRY: ClassVar[Sensor]
    TRUE_POSE: ClassVar[Sensor]


Sensor.LASER_SCAN = Sensor("laser_scan")
Sensor.POINT_CLOUD = Sensor("point_cloud")
Sensor.STEREO_IMAGES = Sensor("stereo_images")
Sensor.RGBD_IMAGES = Sensor("rgbd_images")
Sensor.IMU = Sensor("imu")
Sensor.WHEEL_ODOMETRY = Sensor("wheel_odometry")
Sensor.TRUE_POSE = Sensor("true_pose")


@dataclass(frozen=True, slots=True)
class Measurement:
    """What one sensor says at an instant.

    stamp: ns. A subclass is a frozen dataclass with slots; its fields are arrays of one declared dtype, whole and real
    numbers, and planar poses: what can travel to a method.
    """

    sensor: ClassVar[Sensor]
    stamp: int

    def work_out(self) -> None:
        """Work out now what is otherwise worked out when it is first looked at (`simulation/sensors/later.py`)."""


@dataclass(frozen=True, slots=True)
class LaserScan(Measurement):
    """One turn of a planar LiDAR, in the laser frame (x forward, counter-clockwise).

    ranges: (N,) float32 metres; +inf where nothing was hit within range. Ray i points along
    `angle_min + i * angle_increment`. stamp: time of the last ray, so that scans and odometry arrive in stamp order;
    ray i was taken `(N - 1 - i) * time_increment` ns before it (0 for an instant scan).
    """

    sensor: ClassVar[Sensor] = Sensor.LASER_SCAN
    ranges: npt.NDArray[np.float32]
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    time_increment: int = 0

    def angles(self) -> npt.NDArray[np.float64]:
        """(N,) ray directions in radians."""
        return self.angle_min + self.angle_increment * np.arange(len(self.ranges), dtype=np.float64)

    def hits(self) -> npt.NDArray[np.bool_]:
        """(N,) whether a ray met something: a finite range, not 0, range_min <= r < range_max.

        A range of exactly range_max is how many drivers report a miss.
        """
        ranges = np.asarray(self.ranges, dtype=np.float64)
        return np.isfinite(ranges) & (ranges > 0) & (ranges >= self.range_min) & (ranges < self.range_max)


@dataclass(frozen=True, slots=True)
class PointCloud(Measurement):
    """One turn of a 3D LiDAR, in the LiDAR frame; rays without a return are left out.

    points: (N, 3) float32 metres, ring by ring in firing order; ring: (N,) uint16, 0 the lowest; time_offset: (N,)
    int32 ns relative to stamp, never positive: the stamp is that of the last firing (all 0 for an instant turn).
    """

    sensor: ClassVar[Sensor] = Sensor.POINT_CLOUD
    points: npt.NDArray[np.float32]
    ring: npt.NDArray[np.uint16]
    time_offset: npt.NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class StereoImages(Measurement):
    """A rectified pair with exactly equal stamps. left, right: (H, W) or (H, W, 3) uint8."""

    sensor: ClassVar[Sensor] = Sensor.STEREO_IMAGES
    left: npt.NDArray[np.uint8]
    right: npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class RgbdImages(Measurement):
    """An image and the depth of its very pixels. image: (H, W) or (H, W, 3) uint8.

    depth: (H, W) float32, metres along the optical axis, 0 where nothing was measured.
    """

    sensor: ClassVar[Sensor] = Sensor.RGBD_IMAGES
    image: npt.NDArray[np.uint8]
    depth: npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class ImuSamples(Measurement):
    """Inertial samples since the last measurement, in the IMU frame.

    stamps: (K,) int64 ns; angular_velocity: (K, 3) rad/s; linear_acceleration: (K, 3) m/s^2 with gravity
    (at rest +9.8 on z). stamp: the newest sample's.
    """

    sensor: ClassVar[Sensor] = Sensor.IMU
    stamps: npt.NDArray[np.int64]
    angular_velocity: npt.NDArray[np.float64]
    linear_acceleration: npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class WheelOdometry(Measurement):
    """Pose of the base in the drifting `odom` frame, and body velocities (m/s, rad/s)."""

    sensor: ClassVar[Sensor] = Sensor.WHEEL_ODOMETRY
    T_odom_base: SE2
    linear: float
    angular: float


@dataclass(frozen=True, slots=True)
class TruePose(Measurement):
    """The true pose of the base in the frame in which it started. Only for methods of kind `reference`."""

    sensor: ClassVar[Sensor] = Sensor.TRUE_POSE
    T_start_base: SE2
