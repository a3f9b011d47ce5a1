"""Measurements as standard ROS messages (REP-103, REP-105, REP-117), the same for ROS 1 and ROS 2.

What each sensor says stands with it (`bag_sensors.py`, `bag_cameras.py`); here are the messages that they are made of,
and what a recording holds besides:

mounts        tf2_msgs/TFMessage        on /tf_static
the robot     std_msgs/String           on /taskslam/robot: the preset as YAML, of which messages say only a part
ground truth  nav_msgs/Odometry         on /ground_truth/odom, `map` to `base_footprint`
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import yaml

from taskslam.datasets.quaternions import planar_quaternion
from taskslam.geometry import SE2, FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.robot import Camera, Robot
from taskslam.world.floor_plan import FloorPlan

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

BASE, ODOM, MAP = "base_footprint", "odom", "map"
TF_STATIC, ROBOT, TRUTH = "/tf_static", "/taskslam/robot", "/ground_truth/odom"

ALWAYS = (
    (TF_STATIC, "tf2_msgs/msg/TFMessage"),
    (ROBOT, "std_msgs/msg/String"),
    (TRUTH, "nav_msgs/msg/Odometry"),
)


Said = tuple[str, int, Any]
"""Topic, time of the message (ns) and the message."""


class RosEncoder:
    """Builds messages of one typestore."""

    def __init__(self, store: Typestore) -> None:
        self._types = store.types
        self._ros1 = any(field.name == "seq" for field in fields(self._types["std_msgs/msg/Header"]))  # type: ignore[arg-type]

    def opening(self, stamp: int, frames: Iterable[tuple[str, FloatArray]], robot: Robot) -> Iterator[Said]:
        """What is said once: where the sensors' frames are, (4, 4) in the base, and the robot."""
        yield TF_STATIC, stamp, self.mounts(stamp, frames)
        text = yaml.safe_dump(robot.model_dump(mode="json"), sort_keys=False)
        yield ROBOT, stamp, self.new("std_msgs/msg/String", data=text)

    def truth(self, stamp: int, pose: SE2) -> Said:
        """The true pose in `map`."""
        return TRUTH, stamp, self.odometry(stamp, MAP, pose, 0.0, 0.0)

    def new(self, kind: str, **fields: Any) -> Any:
        """Make a message from its fields."""
        return self._types[kind](**fields)

    def header(self, stamp: int, frame: str) -> Any:
        """std_msgs/Header."""
        sequence = {"seq": 0} if self._ros1 else {}
        return self.new("std_msgs/msg/Header", stamp=self.time(stamp), frame_id=self.frame(frame), **sequence)

    def time(self, stamp: int) -> Any:
        """An instant (ns)."""
        whole, rest = divmod(stamp, NANOSECONDS)
        return self.new("builtin_interfaces/msg/Time", sec=whole, nanosec=rest)

    def frame(self, name: str) -> str:
        """What one of our frames is called."""
        return name

    def vector(self, x: float, y: float, z: float) -> Any:
        """geometry_msgs/Vector3."""
        return self.new("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=float(z))

    def mounts(self, stamp: int, frames: Iterable[tuple[str, FloatArray]]) -> Any:
        """tf2_msgs/TFMessage of frames by their (4, 4) poses in the base."""
        from scipy.spatial.transform import Rotation

        turned = [(frame, T, Rotation.from_matrix(T[:3, :3]).as_quat().tolist()) for frame, T in frames]
        return self.new(
            "tf2_msgs/msg/TFMessage",
            transforms=[self._transform(stamp, BASE, frame, T[:3, 3].tolist(), xyzw) for frame, T, xyzw in turned],
        )

    def base_in_odom(self, stamp: int, at: SE2) -> Any:
        """tf2_msgs/TFMessage of the base in `odom`."""
        z, w = planar_quaternion(at.theta)
        transform = self._transform(stamp, ODOM, BASE, [at.x, at.y, 0.0], [0.0, 0.0, z, w])
        return self.new("tf2_msgs/msg/TFMessage", transforms=[transform])

    def pose(self, at: SE2) -> Any:
        """geometry_msgs/Pose on the floor."""
        z, w = planar_quaternion(at.theta)
        return self.new(
            "geometry_msgs/msg/Pose",
            position=self.new("geometry_msgs/msg/Point", x=float(at.x), y=float(at.y), z=0.0),
            orientation=self.new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=z, w=w),
        )

    def pose_stamped(self, stamp: int, frame: str, at: SE2) -> Any:
        """geometry_msgs/PoseStamped on the floor."""
        return self.new("geometry_msgs/msg/PoseStamped", header=self.header(stamp, frame), pose=self.pose(at))

    def floor_plan(self, stamp: int, plan: FloorPlan) -> Any:
        """nav_msgs/OccupancyGrid: the floor plan as map_server publishes it; -1 is unknown."""
        rows, columns = plan.cells.shape
        info = self.new(
            "nav_msgs/msg/MapMetaData",
            map_load_time=self.time(stamp),
            resolution=plan.resolution,
            width=columns,
            height=rows,
            origin=self.pose(plan.origin),
        )
        return self.new(
            "nav_msgs/msg/OccupancyGrid",
            header=self.header(stamp, MAP),
            info=info,
            data=plan.cells.astype(np.int8).ravel(),  # UNKNOWN, 255, becomes -1
        )

    def _transform(self, stamp: int, parent: str, child: str, xyz: list[float], xyzw: list[float]) -> Any:
        x, y, z, w = xyzw
        return self.new(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(stamp, parent),
            child_frame_id=self.frame(child),
            transform=self.new(
                "geometry_msgs/msg/Transform",
                translation=self.vector(*xyz),
                rotation=self.new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w),
            ),
        )

    def odometry(self, stamp: int, frame: str, at: SE2, linear: float, angular: float) -> Any:
        """nav_msgs/Odometry of the base in a frame, with its velocities (m/s, rad/s)."""
        return self.new(
            "nav_msgs/msg/Odometry",
            header=self.header(stamp, frame),
            child_frame_id=self.frame(BASE),
            pose=self.new("geometry_msgs/msg/PoseWithCovariance", pose=self.pose(at), covariance=np.zeros(36)),
            twist=self.new(
                "geometry_msgs/msg/TwistWithCovariance", twist=self.twist(linear, angular), covariance=np.zeros(36)
            ),
        )

    def twist(self, linear: float, angular: float) -> Any:
        """geometry_msgs/Twist of a base: m/s ahead and rad/s to the left."""
        return self.new("geometry_msgs/msg/Twist", linear=self.vector(linear, 0, 0), angular=self.vector(0, 0, angular))

    def image(self, stamp: int, frame: str, image: npt.NDArray[Any]) -> Any:
        """sensor_msgs/Image: grey or RGB of 8 bits, or float32 such as depth (REP-118)."""
        height, width = image.shape[:2]
        return self.new(
            "sensor_msgs/msg/Image",
            header=self.header(stamp, frame),
            height=height,
            width=width,
            encoding="32FC1" if image.dtype == np.float32 else "rgb8" if image.ndim == 3 else "mono8",
            is_bigendian=0,
            step=image.nbytes // height,
            data=np.ascontiguousarray(image).ravel().view(np.uint8),
        )

    def camera_info(self, stamp: int, frame: str, camera: Camera, baseline: float = 0.0) -> Any:
        """sensor_msgs/CameraInfo of a camera `baseline` metres to the right of its pair's left."""
        f, (cx, cy) = camera.focal_length, camera.center
        K = np.array([f, 0, cx, 0, f, cy, 0, 0, 1])
        P = np.array([f, 0, cx, -f * baseline, 0, f, cy, 0, 0, 0, 1, 0])
        matrices = {"D": np.zeros(5), "K": K, "R": np.eye(3).ravel(), "P": P}
        return self.new(
            "sensor_msgs/msg/CameraInfo",
            header=self.header(stamp, frame),
            height=camera.height,
            width=camera.width,
            distortion_model="plumb_bob",
            **{name if self._ros1 else name.lower(): value for name, value in matrices.items()},
            binning_x=0,
            binning_y=0,
            roi=self.new(
                "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
            ),
        )
