"""Standard ROS messages as measurements: `ros_encoding.py` the other way round, for anybody's bags.

A number that a message rounds to float32 is taken from the rig where that is the same number, so that a recording of
our own gives back what was recorded bit for bit. Functions raise DatasetError without saying where: their caller knows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.datasets.cloud_clock import CloudClock, cloud_clock
from taskslam.datasets.quaternions import heading, pose_of
from taskslam.errors import DatasetError
from taskslam.geometry import SE2, FloatArray
from taskslam.measurements import NANOSECONDS, ImuSamples, LaserScan, PointCloud, WheelOdometry
from taskslam.robot import Lidar2D

FARTHEST_2D = 100.0  # m: of a laser whose messages say that it sees without end
_SWEEP = 1.2  # times the time between scans: beyond it, time_increment is something else
_MAX_SWEEP = NANOSECONDS  # a turn takes no longer than a second
_POINT_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
_RING_NAMES = ("ring", "line", "channel")
_ENCODINGS = {"mono8": 1, "8UC1": 1, "rgb8": 3, "bgr8": 3, "8UC3": 3, "rgba8": 4, "bgra8": 4}


Image = npt.NDArray[np.uint8]


def stamp_of(message: Any) -> int:
    """The header's stamp in ns."""
    time = message.header.stamp
    stamp = int(time.sec) * NANOSECONDS + int(time.nanosec)
    if stamp < 0:
        raise DatasetError(f"a stamp before the beginning of time ({time.sec} s)")
    return stamp


def pose_message(pose: Any) -> FloatArray:
    """(4, 4) of a geometry_msgs/Pose, or of a Transform's translation and rotation."""
    at = pose.position if hasattr(pose, "position") else pose.translation
    turned = pose.orientation if hasattr(pose, "orientation") else pose.rotation
    T = pose_of((at.x, at.y, at.z), (turned.x, turned.y, turned.z, turned.w))
    if T is None:
        raise DatasetError("a pose that is not finite, or whose quaternion is not of unit length")
    return T


def odometry(message: Any, T_child_base: FloatArray | None) -> WheelOdometry:
    """nav_msgs/Odometry. T_child_base: the base in the message's child frame; None if that is the base."""
    T = pose_message(message.pose.pose)
    if T_child_base is not None:
        T = T @ T_child_base
    linear, angular = float(message.twist.twist.linear.x), float(message.twist.twist.angular.z)
    if not (math.isfinite(linear) and math.isfinite(angular)):
        raise DatasetError("a velocity that is not finite")
    q = message.pose.pose.orientation
    planar = T_child_base is None and q.x == 0 and q.y == 0
    at = SE2(float(T[0, 3]), float(T[1, 3]), heading(q.z, q.w)) if planar else SE2.from_matrix(T)
    return WheelOdometry(stamp_of(message), at, linear, angular)


def imu(message: Any) -> ImuSamples:
    """sensor_msgs/Imu: one sample."""
    gyro, accel = message.angular_velocity, message.linear_acceleration
    values = np.array([[gyro.x, gyro.y, gyro.z, accel.x, accel.y, accel.z]], dtype=np.float64)
    if not np.isfinite(values).all():
        raise DatasetError("an inertial sample that is not finite")
    stamp = stamp_of(message)
    return ImuSamples(stamp, np.array([stamp], np.int64), values[:, :3].copy(), values[:, 3:].copy())


def laser_scan(message: Any, lidar: Lidar2D | None) -> LaserScan:
    """sensor_msgs/LaserScan; ranges outside the limits, zero or NaN are +inf: no return (REP-117).

    lidar: the laser's data sheet, by which a range_max without end and a sweep longer than its period are set right.
    """
    ranges = np.asarray(message.ranges, dtype=np.float32)
    increment = float(message.time_increment)
    range_max = lidar.range_max if lidar else FARTHEST_2D
    range_max = float(message.range_max) if message.range_max < math.inf else range_max
    numbers = (message.angle_min, message.angle_increment, message.range_min, range_max, increment)
    if not len(ranges) or not all(map(math.isfinite, numbers)) or increment < 0 or message.angle_increment == 0:
        raise DatasetError("a scan without ranges, or with an angle, limit or time that is not a number")
    seen = (ranges >= message.range_min) & (ranges <= message.range_max)
    believed = lidar is None or is_within_a_turn(increment * NANOSECONDS, len(ranges), lidar.rate)
    between = round(increment * NANOSECONDS) if believed else 0
    known = (lidar.angle_min, lidar.angle_increment, lidar.range_min, lidar.range_max) if lidar else (None,) * 4
    angle_min, angle_increment, range_min, range_max = map(_unrounded, numbers[:4], known)
    return LaserScan(
        stamp_of(message) + (len(ranges) - 1) * between,
        np.where(seen, ranges, np.float32(np.inf)),
        angle_min,
        angle_increment,
        range_min,
        range_max,
        between,
    )


def clock_of_clouds(messages: Sequence[Any], rate: float | None) -> CloudClock:
    """What the time field of sensor_msgs/PointCloud2 means, by the first of them. rate: Hz, if it is known."""
    told = []
    for message in messages:
        with suppress(DatasetError):
            told.append((columns_of(message), stamp_of(message)))
    return cloud_clock(told, None if rate is None else NANOSECONDS / rate)


def doubts_about_scans(messages: Sequence[Any], lidar: Lidar2D) -> list[str]:
    """What of the first scans is not believed, a sentence each."""
    doubts = []
    first = messages[0]
    increment, rays = float(first.time_increment), len(first.ranges)
    if increment > 0 and not is_within_a_turn(increment * NANOSECONDS, rays, lidar.rate):
        doubts.append(
            f"a sweep of {increment * (rays - 1):.3g} s ({rays} rays, time_increment {increment:g} s) is longer than"
            f" the {1 / lidar.rate:.3g} s from scan to scan: not believed, all rays count as of the stamp"
        )
    if first.range_max == math.inf:
        doubts.append(f"range_max is infinite: taken for {lidar.range_max:g} m")
    return doubts


def is_within_a_turn(between_ns: float, rays: int, rate: float) -> bool:
    """Whether a sweep of so many rays, so many ns apart, takes no longer than the time from one scan to the next."""
    return between_ns * (rays - 1) <= _SWEEP * NANOSECONDS / rate


def point_cloud(message: Any, clock: CloudClock) -> PointCloud:
    """sensor_msgs/PointCloud2 with x, y, z, a ring and, for a turn that takes time, the time of each point."""
    cells = columns_of(message)
    points = np.stack([cells[axis].astype(np.float32) for axis in ("x", "y", "z")], axis=1)
    ring_name = next((name for name in _RING_NAMES if name in cells), None)
    if ring_name is None:
        raise DatasetError(f"a point cloud without a field {', '.join(_RING_NAMES)}; it has {', '.join(cells)}")
    ring = cells[ring_name].astype(np.uint16)
    stamp = stamp_of(message)
    offset = clock.offsets(cells, stamp)
    if len(offset) and max(abs(int(offset.min())), abs(int(offset.max()))) > _MAX_SWEEP:
        raise DatasetError(f"a point cloud whose '{clock.field}' lies more than a second from its stamp")
    kept = np.isfinite(points).all(axis=1) & points.any(axis=1)
    if not kept.all():
        points, ring, offset = points[kept], ring[kept], offset[kept]
    late = int(offset.max(initial=0))
    if (np.diff(ring.astype(np.int64)) < 0).any():
        by_ring = np.lexsort((offset, ring))
        points, ring, offset = points[by_ring], ring[by_ring], offset[by_ring]
    return PointCloud(stamp + late, points, ring, (offset - late).astype(np.int32))


def image(message: Any) -> Image:
    """sensor_msgs/Image of 8 bits a channel as (H, W) grey or (H, W, 3) RGB; copied out of the message."""
    channels = _ENCODINGS.get(message.encoding)
    if channels is None:
        raise DatasetError(f"an image encoded as '{message.encoding}'; expected one of {', '.join(_ENCODINGS)}")
    height, width, step = int(message.height), int(message.width), int(message.step)
    data = np.asarray(message.data, dtype=np.uint8)
    if not (height and width) or step < width * channels or len(data) < height * step:
        raise DatasetError(f"an image of {width}x{height} with {len(data)} bytes; expected {height * step}")
    rows = data[: height * step].reshape(height, step)[:, : width * channels]
    if channels == 1:
        return np.ascontiguousarray(rows)
    pixels = rows.reshape(height, width, channels)[..., :3]
    blue_first = message.encoding.startswith("bgr") or message.encoding == "8UC3"
    return np.ascontiguousarray(pixels[..., ::-1] if blue_first else pixels)


def _unrounded(value: float, known: float | None) -> float:
    """The number of which a message holds the float32."""
    return known if known is not None and float(np.float32(known)) == float(value) else float(value)


def columns_of(message: Any) -> dict[str, npt.NDArray[Any]]:
    """The columns of a cloud by their names."""
    step, count = int(message.point_step), int(message.width) * int(message.height)
    byte_order = ">" if message.is_bigendian else "<"
    formats, names, offsets = [], [], []
    for field in message.fields:
        kind = _POINT_TYPES.get(int(field.datatype))
        if kind is None or int(field.offset) + np.dtype(kind).itemsize > step:
            raise DatasetError(f"a point cloud whose field '{field.name}' is not a number inside a point")
        if field.name not in names:
            names.append(field.name)
            formats.append(byte_order + kind)
            offsets.append(int(field.offset))
    if missing := [axis for axis in ("x", "y", "z") if axis not in names]:
        raise DatasetError(f"a point cloud without the field {', '.join(missing)}")
    data = np.asarray(message.data, dtype=np.uint8)
    row = int(message.row_step) or step * int(message.width)
    if row != step * int(message.width) or len(data) < count * step:
        raise DatasetError(f"a point cloud of {count} points of {step} bytes with {len(data)} bytes in all")
    layout = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": step})
    points = data[: count * step].view(layout)
    return {name: points[name] for name in names}
