"""Measurements as standard ROS messages (REP-103, REP-105, REP-117), the same for ROS 1 and ROS 2.

LaserScan     sensor_msgs/LaserScan     stamped with its first ray, as ROS wants it; no hit is +inf
PointCloud    sensor_msgs/PointCloud2   x y z ring time as the Velodyne driver lays it out; time: s after the stamp
StereoImages  sensor_msgs/Image and CameraInfo for left and right
ImuSamples    sensor_msgs/Imu           one message a sample, without orientation
WheelOdometry nav_msgs/Odometry         `odom` to `base_footprint`
mounts        tf2_msgs/TFMessage        on /tf_static
the robot     std_msgs/String           on /taskslam/robot: the preset as YAML, of which messages say only a part
ground truth  nav_msgs/Odometry         on /ground_truth/odom, `map` to `base_footprint`
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from taskslam.datasets.quaternions import planar_quaternion
from taskslam.geometry import OPTICAL_IN_BODY, SE2, FloatArray
from taskslam.measurements import (
    NANOSECONDS,
    ImuSamples,
    LaserScan,
    Measurement,
    PointCloud,
    Sensor,
    StereoImages,
    WheelOdometry,
)
from taskslam.robot import Robot

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

BASE, ODOM, MAP = "base_footprint", "odom", "map"
LASER, LIDAR, IMU = "laser", "velodyne", "imu_link"
OPTICAL = ("left_camera_optical_frame", "right_camera_optical_frame")
TF_STATIC, ROBOT, TRUTH = "/tf_static", "/taskslam/robot", "/ground_truth/odom"

TOPICS: dict[Sensor, tuple[tuple[str, str], ...]] = {
    Sensor.WHEEL_ODOMETRY: (("/odom", "nav_msgs/msg/Odometry"),),
    Sensor.IMU: (("/imu", "sensor_msgs/msg/Imu"),),
    Sensor.LASER_SCAN: (("/scan", "sensor_msgs/msg/LaserScan"),),
    Sensor.POINT_CLOUD: (("/velodyne_points", "sensor_msgs/msg/PointCloud2"),),
    Sensor.STEREO_IMAGES: (
        ("/stereo/left/image_rect", "sensor_msgs/msg/Image"),
        ("/stereo/left/camera_info", "sensor_msgs/msg/CameraInfo"),
        ("/stereo/right/image_rect", "sensor_msgs/msg/Image"),
        ("/stereo/right/camera_info", "sensor_msgs/msg/CameraInfo"),
    ),
}
ALWAYS = (
    (TF_STATIC, "tf2_msgs/msg/TFMessage"),
    (ROBOT, "std_msgs/msg/String"),
    (TRUTH, "nav_msgs/msg/Odometry"),
)
_POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("ring", "<u2"), ("time", "<f4")])
_ROS_TYPES = {"<f4": 7, "<u2": 4}  # sensor_msgs/PointField

Said = tuple[str, int, Any]
"""Topic, time of the message (ns) and the message."""


class RosEncoder:
    """Builds messages of one typestore for one robot."""

    def __init__(self, store: Typestore, robot: Robot) -> None:
        self._types = store.types
        self._robot = robot
        self._ros1 = any(field.name == "seq" for field in fields(self._types["std_msgs/msg/Header"]))  # type: ignore[arg-type]

    def opening(self, stamp: int) -> Iterator[Said]:
        """What is said once: mounts and the robot."""
        rig = self._robot.rig
        frames = []
        if rig.lidar_2d:
            frames.append((LASER, rig.lidar_2d.mount.matrix()))
        if rig.lidar_3d:
            frames.append((LIDAR, rig.lidar_3d.mount.matrix()))
        if rig.imu:
            frames.append((IMU, rig.imu.mount.matrix()))
        for eye, frame in enumerate(OPTICAL if rig.stereo else ()):
            assert rig.stereo is not None
            beside = np.eye(4)
            beside[1, 3] = -rig.stereo.baseline * eye
            frames.append((frame, rig.stereo.mount.matrix() @ beside @ OPTICAL_IN_BODY))
        transforms = [self._transform(stamp, frame, T) for frame, T in frames]
        yield TF_STATIC, stamp, self._new("tf2_msgs/msg/TFMessage", transforms=transforms)
        text = yaml.safe_dump(self._robot.model_dump(mode="json"), sort_keys=False)
        yield ROBOT, stamp, self._new("std_msgs/msg/String", data=text)

    def truth(self, stamp: int, pose: SE2) -> Said:
        """The true pose in `map`."""
        return TRUTH, stamp, self._odometry(stamp, MAP, pose, 0.0, 0.0)

    def messages(self, measurement: Measurement) -> Iterator[Said]:
        """The messages that carry one measurement."""
        stamp = measurement.stamp
        match measurement:
            case WheelOdometry():
                at, linear, angular = measurement.T_odom_base, measurement.linear, measurement.angular
                yield "/odom", stamp, self._odometry(stamp, ODOM, at, linear, angular)
            case ImuSamples():
                for at, gyro, accel in zip(
                    measurement.stamps.tolist(),
                    measurement.angular_velocity.tolist(),
                    measurement.linear_acceleration.tolist(),
                    strict=True,
                ):
                    yield "/imu", at, self._imu(at, gyro, accel)
            case LaserScan():
                yield "/scan", stamp, self._scan(measurement)
            case PointCloud():
                yield "/velodyne_points", stamp, self._cloud(measurement)
            case StereoImages():
                for eye, image in enumerate((measurement.left, measurement.right)):
                    side = "left" if eye == 0 else "right"
                    yield f"/stereo/{side}/image_rect", stamp, self._image(stamp, eye, image)
                    yield f"/stereo/{side}/camera_info", stamp, self._camera_info(stamp, eye)
            case _:
                raise AssertionError(f"{measurement.sensor} is never exported")

    def _new(self, kind: str, **fields: Any) -> Any:
        return self._types[kind](**fields)

    def _header(self, stamp: int, frame: str) -> Any:
        whole, rest = divmod(stamp, NANOSECONDS)
        time = self._new("builtin_interfaces/msg/Time", sec=whole, nanosec=rest)
        sequence = {"seq": 0} if self._ros1 else {}
        return self._new("std_msgs/msg/Header", stamp=time, frame_id=frame, **sequence)

    def _vector(self, x: float, y: float, z: float) -> Any:
        return self._new("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=float(z))

    def _transform(self, stamp: int, frame: str, T_base_frame: FloatArray) -> Any:
        from scipy.spatial.transform import Rotation

        x, y, z, w = Rotation.from_matrix(T_base_frame[:3, :3]).as_quat().tolist()
        return self._new(
            "geometry_msgs/msg/TransformStamped",
            header=self._header(stamp, BASE),
            child_frame_id=frame,
            transform=self._new(
                "geometry_msgs/msg/Transform",
                translation=self._vector(*T_base_frame[:3, 3].tolist()),
                rotation=self._new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w),
            ),
        )

    def _odometry(self, stamp: int, frame: str, at: SE2, linear: float, angular: float) -> Any:
        z, w = planar_quaternion(at.theta)
        pose = self._new(
            "geometry_msgs/msg/Pose",
            position=self._new("geometry_msgs/msg/Point", x=float(at.x), y=float(at.y), z=0.0),
            orientation=self._new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=z, w=w),
        )
        twist = self._new(
            "geometry_msgs/msg/Twist", linear=self._vector(linear, 0, 0), angular=self._vector(0, 0, angular)
        )
        return self._new(
            "nav_msgs/msg/Odometry",
            header=self._header(stamp, frame),
            child_frame_id=BASE,
            pose=self._new("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36)),
            twist=self._new("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
        )

    def _imu(self, stamp: int, gyro: list[float], accel: list[float]) -> Any:
        imu = self._robot.rig.imu
        assert imu is not None
        unknown = np.zeros(9)
        unknown[0] = -1.0  # "no orientation", as the message's definition has it
        return self._new(
            "sensor_msgs/msg/Imu",
            header=self._header(stamp, IMU),
            orientation=self._new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
            orientation_covariance=unknown,
            angular_velocity=self._vector(*gyro),
            angular_velocity_covariance=(np.eye(3) * imu.gyro_noise**2).ravel(),
            linear_acceleration=self._vector(*accel),
            linear_acceleration_covariance=(np.eye(3) * imu.accel_noise**2).ravel(),
        )

    def _scan(self, scan: LaserScan) -> Any:
        lidar = self._robot.rig.lidar_2d
        assert lidar is not None
        last = len(scan.ranges) - 1
        return self._new(
            "sensor_msgs/msg/LaserScan",
            header=self._header(scan.stamp - last * scan.time_increment, LASER),
            angle_min=scan.angle_min,
            angle_max=scan.angle_min + last * scan.angle_increment,
            angle_increment=scan.angle_increment,
            time_increment=scan.time_increment / NANOSECONDS,
            scan_time=1.0 / lidar.rate,
            range_min=scan.range_min,
            range_max=scan.range_max,
            ranges=scan.ranges,
            intensities=np.empty(0, np.float32),
        )

    def _cloud(self, cloud: PointCloud) -> Any:
        points = np.empty(len(cloud.points), _POINT)
        for axis, name in enumerate(("x", "y", "z")):
            points[name] = cloud.points[:, axis]
        points["ring"] = cloud.ring
        points["time"] = cloud.time_offset / NANOSECONDS
        layout = [
            self._new("sensor_msgs/msg/PointField", name=name, offset=offset, datatype=_ROS_TYPES[kind.str], count=1)
            for name, (kind, offset, *_) in (_POINT.fields or {}).items()
        ]
        return self._new(
            "sensor_msgs/msg/PointCloud2",
            header=self._header(cloud.stamp, LIDAR),
            height=1,
            width=len(points),
            fields=layout,
            is_bigendian=False,
            point_step=_POINT.itemsize,
            row_step=points.nbytes,
            data=points.view(np.uint8),
            is_dense=True,
        )

    def _image(self, stamp: int, eye: int, image: Any) -> Any:
        height, width = image.shape[:2]
        return self._new(
            "sensor_msgs/msg/Image",
            header=self._header(stamp, OPTICAL[eye]),
            height=height,
            width=width,
            encoding="rgb8" if image.ndim == 3 else "mono8",
            is_bigendian=0,
            step=image.nbytes // height,
            data=np.ascontiguousarray(image).ravel(),
        )

    def _camera_info(self, stamp: int, eye: int) -> Any:
        stereo = self._robot.rig.stereo
        assert stereo is not None
        f, (cx, cy) = stereo.focal_length, stereo.center
        K = np.array([f, 0, cx, 0, f, cy, 0, 0, 1])
        P = np.array([f, 0, cx, -f * stereo.baseline * eye, 0, f, cy, 0, 0, 0, 1, 0])
        matrices = {"D": np.zeros(5), "K": K, "R": np.eye(3).ravel(), "P": P}
        return self._new(
            "sensor_msgs/msg/CameraInfo",
            header=self._header(stamp, OPTICAL[eye]),
            height=stereo.height,
            width=stereo.width,
            distortion_model="plumb_bob",
            **{name if self._ros1 else name.lower(): value for name, value in matrices.items()},
            binning_x=0,
            binning_y=0,
            roi=self._new(
                "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
            ),
        )
