"""LiDARs, IMU and wheel odometry in bags.

LaserScan     sensor_msgs/LaserScan     stamped with its first ray, as ROS wants it; no hit is +inf
PointCloud    sensor_msgs/PointCloud2   x y z ring time as the Velodyne driver lays it out; time: s after the stamp
ImuSamples    sensor_msgs/Imu           one message a sample, without orientation
WheelOdometry nav_msgs/Odometry         `odom` to `base_footprint`
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from taskslam.datasets import bag_rig, ros_decoding
from taskslam.datasets.bag_sensor import BagSensor, Recording
from taskslam.datasets.ros_encoding import ODOM, RosEncoder, Said
from taskslam.datasets.stamp_order import Pairing
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS, ImuSamples, LaserScan, PointCloud, WheelOdometry
from taskslam.robot import Imu, Lidar2D, Lidar3D, Odometer, load_robot

_LASER, _LIDAR, _IMU = "laser", "velodyne", "imu_link"
_POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("ring", "<u2"), ("time", "<f4")])
_ROS_TYPES = {"<f4": 7, "<u2": 4}  # sensor_msgs/PointField


class Scans(BagSensor):
    """A planar LiDAR."""

    def __init__(self, recording: Recording, given: Lidar2D | None) -> None:
        topic = recording.topic("laser_scan")
        first = recording.first(topic)
        self.part: Lidar2D = given or bag_rig.lidar_2d(first, recording.frames)
        for note in ros_decoding.doubts_about_scans(first, self.part):
            recording.note(f"{topic}: {note}")

    @staticmethod
    def frames(part: Lidar2D) -> list[tuple[str, FloatArray]]:
        """One."""
        return [(_LASER, part.mount.matrix())]

    @staticmethod
    def messages(encoder: RosEncoder, part: Lidar2D, measurement: LaserScan) -> Iterator[Said]:
        """One message a scan."""
        last = len(measurement.ranges) - 1
        message = encoder.new(
            "sensor_msgs/msg/LaserScan",
            header=encoder.header(measurement.stamp - last * measurement.time_increment, _LASER),
            angle_min=measurement.angle_min,
            angle_max=measurement.angle_min + last * measurement.angle_increment,
            angle_increment=measurement.angle_increment,
            time_increment=measurement.time_increment / NANOSECONDS,
            scan_time=1.0 / part.rate,
            range_min=measurement.range_min,
            range_max=measurement.range_max,
            ranges=measurement.ranges,
            intensities=np.empty(0, np.float32),
        )
        yield "/scan", measurement.stamp, message

    def measurement(self, role: str, content: Any, pairing: Pairing) -> LaserScan:  # noqa: ARG002
        """A message is a scan."""
        return ros_decoding.laser_scan(content, self.part)


class Clouds(BagSensor):
    """A spinning LiDAR."""

    def __init__(self, recording: Recording, given: Lidar3D | None) -> None:
        topic = recording.topic("point_cloud")
        first = recording.first(topic)
        self._clock = ros_decoding.clock_of_clouds(first, bag_rig.rate_or_none(first))
        if self._clock.note:
            recording.note(f"{topic}: {self._clock.note}")
        self.part: Lidar3D = given or bag_rig.lidar_3d(first, recording.frames, self._clock)

    @staticmethod
    def frames(part: Lidar3D) -> list[tuple[str, FloatArray]]:
        """One."""
        return [(_LIDAR, part.mount.matrix())]

    @staticmethod
    def messages(encoder: RosEncoder, part: Lidar3D, measurement: PointCloud) -> Iterator[Said]:  # noqa: ARG004
        """One message a turn."""
        points = np.empty(len(measurement.points), _POINT)
        for axis, name in enumerate(("x", "y", "z")):
            points[name] = measurement.points[:, axis]
        points["ring"] = measurement.ring
        points["time"] = measurement.time_offset / NANOSECONDS
        layout = [
            encoder.new("sensor_msgs/msg/PointField", name=name, offset=offset, datatype=_ROS_TYPES[kind.str], count=1)
            for name, (kind, offset, *_) in (_POINT.fields or {}).items()
        ]
        message = encoder.new(
            "sensor_msgs/msg/PointCloud2",
            header=encoder.header(measurement.stamp, _LIDAR),
            height=1,
            width=len(points),
            fields=layout,
            is_bigendian=False,
            point_step=_POINT.itemsize,
            row_step=points.nbytes,
            data=points.view(np.uint8),
            is_dense=True,
        )
        yield "/velodyne_points", measurement.stamp, message

    def measurement(self, role: str, content: Any, pairing: Pairing) -> PointCloud:  # noqa: ARG002
        """A message is a turn."""
        return ros_decoding.point_cloud(content, self._clock)


class Inertial(BagSensor):
    """An IMU."""

    def __init__(self, recording: Recording, given: Imu | None) -> None:
        self.part: Imu = given or bag_rig.imu(recording.first(recording.topic("imu")), recording.frames)

    @staticmethod
    def frames(part: Imu) -> list[tuple[str, FloatArray]]:
        """One."""
        return [(_IMU, part.mount.matrix())]

    @staticmethod
    def messages(encoder: RosEncoder, part: Imu, measurement: ImuSamples) -> Iterator[Said]:
        """A message for every sample."""
        unknown = np.zeros(9)
        unknown[0] = -1.0  # "no orientation", as the message's definition has it
        for stamp, gyro, accel in zip(
            measurement.stamps.tolist(),
            measurement.angular_velocity.tolist(),
            measurement.linear_acceleration.tolist(),
            strict=True,
        ):
            message = encoder.new(
                "sensor_msgs/msg/Imu",
                header=encoder.header(stamp, _IMU),
                orientation=encoder.new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
                orientation_covariance=unknown,
                angular_velocity=encoder.vector(*gyro),
                angular_velocity_covariance=(np.eye(3) * part.gyro_noise**2).ravel(),
                linear_acceleration=encoder.vector(*accel),
                linear_acceleration_covariance=(np.eye(3) * part.accel_noise**2).ravel(),
            )
            yield "/imu", stamp, message

    def measurement(self, role: str, content: Any, pairing: Pairing) -> ImuSamples:  # noqa: ARG002
        """A message is a sample."""
        return ros_decoding.imu(content)


class Odometry(BagSensor):
    """Wheel odometry, of which no message tells the noise: that of the robot, or of a TurtleBot 2."""

    def __init__(self, recording: Recording, given: Odometer | None) -> None:
        self.part: Odometer = given or load_robot("turtlebot2").rig.odometry
        self._frames = recording.frames

    @staticmethod
    def frames(part: Odometer) -> list[tuple[str, FloatArray]]:  # noqa: ARG004
        """It speaks of the base itself."""
        return []

    @staticmethod
    def messages(encoder: RosEncoder, part: Odometer, measurement: WheelOdometry) -> Iterator[Said]:  # noqa: ARG004
        """The pose in `odom`."""
        stamp, at = measurement.stamp, measurement.T_odom_base
        yield "/odom", stamp, encoder.odometry(stamp, ODOM, at, measurement.linear, measurement.angular)

    def measurement(self, role: str, content: Any, pairing: Pairing) -> WheelOdometry:  # noqa: ARG002
        """A message is a pose; of a frame that is not the base, it is moved there."""
        return ros_decoding.odometry(content, self._frames.T_child_base(content.child_frame_id))
