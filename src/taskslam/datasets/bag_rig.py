"""The rig of a recording that does not come with a robot file: from its first messages and its static transforms.

What no message tells is left at zero (noise), or named here: the least and greatest range of a spinning LiDAR.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

from taskslam.datasets import ros_decoding
from taskslam.datasets.cloud_clock import CloudClock
from taskslam.datasets.distortion import lens
from taskslam.datasets.stereo_rectification import CameraCalibration, mount_of
from taskslam.errors import DatasetError
from taskslam.geometry import FloatArray, invert_se3, pose_from_xyz_rpy
from taskslam.measurements import NANOSECONDS
from taskslam.robot import Imu, Lidar2D, Lidar3D

Decoded = TypeVar("Decoded")

_RANGES_3D = (0.5, 100.0)  # m
_MOST_RINGS = 256
_BASES = ("base_footprint", "base_link")


class Frames:
    """Poses of frames in one another, from static transforms and mounts that the user gives."""

    def __init__(self, transforms: list[Any], base: str | None, child: str | None, mounts: Mapping[str, str]) -> None:
        """transforms: geometry_msgs/TransformStamped; base: the base's frame; child: that of odometry, if any.

        Raises DatasetError for a mount that is not six numbers or a transform that is none.
        """
        self._edges: dict[str, dict[str, FloatArray]] = {}
        for transform in transforms:
            T = ros_decoding.pose_message(transform.transform)
            self._connect(transform.header.frame_id, transform.child_frame_id, T)
        known = [frame for frame in _BASES if frame in self._edges or frame == child]
        self.base = base or next(iter(known), child or _BASES[1])
        for frame, text in mounts.items():
            self._connect(self.base, frame, _mount(frame, text))

    def T_base(self, frame: str) -> FloatArray:  # noqa: N802 a pose carries its frames in its name
        """(4, 4) pose of a frame in the base. Raises DatasetError if nothing connects the two."""
        target = _plain(frame)
        found = {_plain(self.base): np.eye(4)}
        queue = deque(found)
        while queue and target not in found:
            at = queue.popleft()
            for neighbour, T in self._edges.get(at, {}).items():
                if neighbour not in found:
                    found[neighbour] = found[at] @ T
                    queue.append(neighbour)
        if target not in found:
            raise DatasetError(
                f"No static transform connects the frame '{frame}' to the base '{self.base}': give"
                f" --mount {frame}=x,y,z,roll,pitch,yaw, or --base-frame, or --robot"
            )
        return found[target]

    def T_child_base(self, child: str) -> FloatArray | None:  # noqa: N802
        """(4, 4) pose of the base in the frame of which a message speaks; None if that is the base itself.

        A frame that nothing connects to the base is taken for it: many recordings of poses have no transforms.
        """
        if _plain(child) in ("", _plain(self.base)):
            return None
        try:
            return invert_se3(self.T_base(child))
        except DatasetError:
            return None

    def _connect(self, parent: str, child: str, T_parent_child: FloatArray) -> None:
        parent, child = _plain(parent), _plain(child)
        self._edges.setdefault(parent, {})[child] = T_parent_child
        self._edges.setdefault(child, {})[parent] = invert_se3(T_parent_child)


def lidar_2d(messages: list[Any], frames: Frames) -> Lidar2D:
    """From the first scans that can be read."""
    scan, messages = _first_good(messages, lambda message: ros_decoding.laser_scan(message, None))
    rate = rate_of(messages)
    return Lidar2D(
        mount=mount_of(frames.T_base(messages[0].header.frame_id)),
        rate=rate,
        samples=max(2, len(scan.ranges)),
        angle_min=scan.angle_min,
        angle_max=scan.angle_min + (len(scan.ranges) - 1) * scan.angle_increment,
        range_min=scan.range_min,
        range_max=scan.range_max,
        noise=0.0,
        rolling=scan.time_increment > 0 and ros_decoding.is_within_a_turn(scan.time_increment, len(scan.ranges), rate),
    )


def lidar_3d(messages: list[Any], frames: Frames, clock: CloudClock) -> Lidar3D:
    """From the first clouds. A ring may see nothing there, so their number is the next power of two, as LiDARs have."""
    _, messages = _first_good(messages, lambda message: ros_decoding.point_cloud(message, clock))
    clouds = [ros_decoding.point_cloud(message, clock) for message in messages]
    if not any(len(cloud.points) for cloud in clouds):
        raise DatasetError("The first point clouds are empty, so their LiDAR cannot be told: give --robot")
    rings = 1 + max(int(cloud.ring.max()) for cloud in clouds if len(cloud.ring))
    if rings > _MOST_RINGS:
        raise DatasetError(f"A point cloud with ring {rings - 1}; expected less than {_MOST_RINGS}")
    points = np.concatenate([cloud.points for cloud in clouds])
    x, y, z = points.astype(np.float64).T
    elevation = np.arctan2(z, np.hypot(x, y))
    return Lidar3D(
        mount=mount_of(frames.T_base(messages[0].header.frame_id)),
        rate=rate_of(messages),
        rings=1 << (rings - 1).bit_length(),
        samples=max(2, *(int(np.bincount(cloud.ring, minlength=1).max()) for cloud in clouds)),
        elevation_min=float(elevation.min()),
        elevation_max=float(elevation.max()),
        range_min=_RANGES_3D[0],
        range_max=_RANGES_3D[1],
        noise=0.0,
        rolling=any(bool(cloud.time_offset.any()) for cloud in clouds),
    )


def _first_good(messages: list[Any], decode: Callable[[Any], Decoded]) -> tuple[Decoded, list[Any]]:
    """The first measurement that can be decoded, and the messages that can be. Raises what the first one has wrong."""
    good, found, first_fault = [], [], None
    for message in messages:
        try:
            found.append(decode(message))
            good.append(message)
        except DatasetError as error:
            first_fault = first_fault or error
    if not found:
        raise first_fault or DatasetError("It holds no message")
    return found[0], good


def imu(messages: list[Any], frames: Frames) -> Imu:
    """From the first samples; noise from their covariances, where these are given."""
    _, messages = _first_good(messages, ros_decoding.imu)
    first = messages[0]
    return Imu(
        mount=mount_of(frames.T_base(first.header.frame_id)),
        rate=rate_of(messages),
        gyro_noise=_deviation(first.angular_velocity_covariance),
        accel_noise=_deviation(first.linear_acceleration_covariance),
    )


def cameras(
    left: Any, right: Any, image_topic: str, frames: Frames, left_frame: str
) -> tuple[CameraCalibration, CameraCalibration]:
    """Both cameras from their CameraInfo. left_frame: the frame of the left images.

    Images on a topic `image_rect...`, or without distortion, are those of the projection matrix P: the right camera
    then stands as P says (REP 104). Others are raw: each camera stands where its own frame does, with K and D.
    """
    rectified = "image_rect" in image_topic or not (any(_matrix(left, "D")) or any(_matrix(right, "D")))
    T_left = frames.T_base(left_frame or left.header.frame_id)
    if not rectified:
        return raw_camera(left, T_left), raw_camera(right, frames.T_base(right.header.frame_id))
    turned = np.eye(4)
    turned[:3, :3] = np.reshape(_matrix(left, "R") if any(_matrix(left, "R")) else np.eye(3), (3, 3)).T
    P_left, P_right = (np.reshape(_matrix(info, "P"), (3, 4)) for info in (left, right))
    if not (P_left[0, 0] > 0 and P_right[0, 0] > 0 and P_right[0, 3] < 0):
        raise DatasetError(
            f"The right camera's CameraInfo gives a baseline of {-P_right[0, 3] / (P_right[0, 0] or 1.0):g} m (from P);"
            " expected a positive one: is it a stereo pair, and are left and right not swapped?"
        )
    beside = np.eye(4)
    beside[0, 3] = -P_right[0, 3] / P_right[0, 0]
    T_rectified = T_left @ turned
    return _projected(left, P_left, T_rectified), _projected(right, P_right, T_rectified @ beside)


def raw_camera(info: Any, T_base_optical: FloatArray) -> CameraCalibration:
    """A camera by its K and D. Raises DatasetError where they are not those of a calibrated camera."""
    K, D = np.reshape(_matrix(info, "K"), (3, 3)), tuple(_matrix(info, "D"))
    model, coefficients = lens(info.distortion_model, D, "A CameraInfo")
    if not (K[0, 0] > 0 and K[1, 1] > 0):
        raise DatasetError("A CameraInfo without focal lengths: the camera is not calibrated")
    intrinsics = (float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
    return CameraCalibration(*_image_size(info), intrinsics, model, coefficients, T_base_optical)


def _projected(info: Any, P: FloatArray, T_base_optical: FloatArray) -> CameraCalibration:
    intrinsics = (float(P[0, 0]), float(P[1, 1]), float(P[0, 2]), float(P[1, 2]))
    return CameraCalibration(*_image_size(info), intrinsics, "none", (), T_base_optical)


def _image_size(info: Any) -> tuple[int, int]:
    width, height = int(info.width), int(info.height)
    if not (16 <= width <= 8192 and 16 <= height <= 8192):
        raise DatasetError(f"A CameraInfo of {width}x{height} pixels; expected 16 to 8192 a side")
    return width, height


def _matrix(info: Any, name: str) -> list[float]:
    """D, K, R or P, which ROS 2 writes in lower case."""
    values = [float(value) for value in getattr(info, name if hasattr(info, name) else name.lower())]
    if not all(map(math.isfinite, values)):
        raise DatasetError(f"A CameraInfo whose {name} is not finite")
    return values


def _deviation(covariance: Any) -> float:
    variance = float(np.mean([covariance[0], covariance[4], covariance[8]]))
    return math.sqrt(variance) if math.isfinite(variance) and variance > 0 else 0.0


def rate_of(messages: list[Any]) -> float:
    """Hz from the stamps of the first messages."""
    stamps = [ros_decoding.stamp_of(message) for message in messages]
    span = stamps[-1] - stamps[0]
    if span <= 0:
        raise DatasetError("Its first messages do not tell a rate: they have one stamp; give --robot")
    return (len(stamps) - 1) * NANOSECONDS / span


def rate_or_none(messages: list[Any]) -> float | None:
    """The same, or None where they do not tell."""
    try:
        return rate_of(messages)
    except DatasetError:
        return None


def _mount(frame: str, text: str) -> FloatArray:
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 6 or not all(map(math.isfinite, numbers)):
        raise DatasetError(f"--mount {frame}={text}: expected x,y,z,roll,pitch,yaw in metres and radians")
    return pose_from_xyz_rpy(numbers[:3], numbers[3:])


def _plain(frame: str) -> str:
    """ROS 1 also writes frames with a slash in front."""
    return frame.lstrip("/")
