"""`Bag`: a ROS 1 bag, ROS 2 bag or MCAP as a dataset.

Sensors are found by the types of the topics (`bag_topics.py`), their places by /tf_static. The rig is the one that our
own export writes into the bag, or that of a robot file, or follows from the messages (`bag_rig.py`). Measurements come
in the order of their own stamps, not of their recording.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from taskslam.datasets import bag_rig, ros_decoding, ros_encoding
from taskslam.datasets.bag_access import Message, read_messages, topic_types
from taskslam.datasets.bag_topics import Role, choose_topics
from taskslam.datasets.dataset import Dataset, TruthPose
from taskslam.datasets.stamp_order import Pairing, in_stamp_order
from taskslam.datasets.stereo_rectification import Rectifier, same_camera
from taskslam.errors import DatasetError
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS, Measurement, Sensor, StereoImages
from taskslam.robot import Robot, SensorRig, load_robot
from taskslam.user_files import check, complaint, keys_of, mapping_of

_ROLES: dict[Sensor, tuple[Role, ...]] = {
    Sensor.LASER_SCAN: (Role.LASER_SCAN,),
    Sensor.POINT_CLOUD: (Role.POINT_CLOUD,),
    Sensor.IMU: (Role.IMU,),
    Sensor.WHEEL_ODOMETRY: (Role.WHEEL_ODOMETRY,),
    Sensor.STEREO_IMAGES: (Role.LEFT, Role.RIGHT),
}
_FEW = 5
_STATIC_MESSAGES = 1000
_Part = TypeVar("_Part")


class Bag(Dataset):
    """One recording in a bag."""

    kind = "bag"

    def __init__(
        self,
        path: Path,
        robot: Robot | None,
        topics: Mapping[str, str],
        base_frame: str | None,
        mounts: Mapping[str, str],
    ) -> None:
        """Look at the topics, the static transforms and the first messages.

        robot: instead of the one that the bag may hold; topics: role to topic, where types alone do not tell;
        base_frame: default base_footprint or base_link; mounts: frame to `x,y,z,roll,pitch,yaw` in the base, where no
        static transform tells. Raises DatasetError.
        """
        super().__init__(path)
        self._types = topic_types(path)
        self._topics, unclear = choose_topics(self._types, topics)
        robot = robot or self._own_robot()
        self._frames = self._read_frames(base_frame, mounts)
        self._rectifier: Rectifier | None = None
        given = robot.rig if robot else None
        nominal = given or load_robot("turtlebot2").rig
        usable = [sensor for sensor in _ROLES if self._has(sensor, unclear)]
        parts: dict[str, Any] = {
            "lidar_2d": self._part(usable, Sensor.LASER_SCAN, given and given.lidar_2d, bag_rig.lidar_2d),
            "lidar_3d": self._part(usable, Sensor.POINT_CLOUD, given and given.lidar_3d, bag_rig.lidar_3d),
            "imu": self._part(usable, Sensor.IMU, given and given.imu, bag_rig.imu),
        }
        if Sensor.STEREO_IMAGES in usable:
            parts["stereo"] = self._attempt(usable, Sensor.STEREO_IMAGES, lambda: self._cameras(given))
        self.sensors = frozenset(usable)
        self.rig = SensorRig(odometry=nominal.odometry, **parts)

    def measurements(self, sensors: Collection[Sensor]) -> Iterator[Measurement]:
        """What these sensors said; see `Dataset`."""
        wanted = self.sensors.intersection(sensors)
        return in_stamp_order(self._decoded(wanted), self.skipped)

    def truth(self) -> Iterator[TruthPose]:
        """The poses of the truth topic, in its own world frame; one out of order is left out and counted."""
        topic = self._topics.get(Role.TRUTH)
        newest = -1
        for message in read_messages(self.path, [topic] if topic else []):
            with _placed(self.path, message):
                stamp, T = ros_decoding.stamp_of(message.content), self._true_pose(message.content)
            if stamp <= newest:
                self.skipped["true poses out of order"] += 1
                continue
            newest = stamp
            yield TruthPose(stamp, T)

    def _decoded(self, sensors: Collection[Sensor]) -> Iterator[Measurement]:
        roles = {self._topics[role]: role for sensor in sensors for role in _ROLES[sensor]}
        pairing = Pairing(self.skipped)
        for message in read_messages(self.path, roles):
            with _placed(self.path, message):
                measurement = self._measurement(roles[message.topic], message.content, pairing)
            if measurement is not None:
                yield measurement
        pairing.end()

    def _measurement(self, role: Role, content: Any, pairing: Pairing) -> Measurement | None:
        match role:
            case Role.WHEEL_ODOMETRY:
                return ros_decoding.odometry(content, self._frames.T_child_base(content.child_frame_id))
            case Role.IMU:
                return ros_decoding.imu(content)
            case Role.LASER_SCAN:
                return ros_decoding.laser_scan(content, self.rig.lidar_2d)
            case Role.POINT_CLOUD:
                return ros_decoding.point_cloud(content)
            case _:
                return self._pair(0 if role is Role.LEFT else 1, content, pairing)

    def _pair(self, eye: int, content: Any, pairing: Pairing) -> Measurement | None:
        camera = self.rig.stereo
        assert camera is not None
        image = ros_decoding.image(content)
        shape = (camera.height, camera.width, 3)[: 3 if camera.color else 2]
        if image.shape != shape:
            raise DatasetError(f"an image of shape {image.shape}; expected {shape} as the first one")
        pair = pairing.add(eye, ros_decoding.stamp_of(content), image)
        if pair is None or self._rectifier is None:
            return pair
        return StereoImages(pair.stamp, *self._rectifier(pair.left, pair.right))

    def _has(self, sensor: Sensor, unclear: Mapping[Role, str]) -> bool:
        """Whether all topics of a sensor are known; else says why not, where there is something to say."""
        roles = _ROLES[sensor]
        if all(role in self._topics for role in roles):
            return True
        if reasons := [unclear[role] for role in roles if role in unclear]:
            self.why_not[sensor] = reasons[0]
        return False

    def _part(
        self,
        usable: list[Sensor],
        sensor: Sensor,
        given: _Part | None,
        derive: Callable[[list[Any], bag_rig.Frames], _Part],
    ) -> _Part | None:
        """A part of the rig: as given, or derived from the first messages."""
        if sensor not in usable or given is not None:
            return given
        return self._attempt(usable, sensor, lambda: derive(self._first(_ROLES[sensor][0]), self._frames))

    def _attempt(self, usable: list[Sensor], sensor: Sensor, make: Callable[[], _Part]) -> _Part | None:
        """The part; a sensor whose place or kind cannot be told is not usable, and the rest of the bag still is."""
        try:
            return make()
        except (DatasetError, ValidationError) as error:
            usable.remove(sensor)
            self.why_not[sensor] = complaint(error) if isinstance(error, ValidationError) else str(error)
            return None

    def _cameras(self, given: SensorRig | None) -> Any:
        """The rectified pair; prepares the rectification if the images need it."""
        left, right = self._topics[Role.LEFT], self._topics[Role.RIGHT]
        infos = [topic.rsplit("/", 1)[0] + "/camera_info" for topic in (left, right)]
        first = self._first(Role.LEFT)
        image = ros_decoding.image(first[0])
        if not all(info in self._types for info in infos):
            if given is None or given.stereo is None:
                raise DatasetError(
                    f"The images have no {' and '.join(infos)}, so their cameras cannot be told: give --robot"
                )
            return given.stereo
        messages = [self._first_on(info)[0] for info in infos]
        calibrated = bag_rig.cameras(messages[0], messages[1], left, self._frames, first[0].header.frame_id)
        self._rectifier = Rectifier(*calibrated, bag_rig.rate_of(first), image.ndim == 3)
        camera = self._rectifier.camera
        if given is not None and given.stereo is not None and same_camera(camera, given.stereo):
            return given.stereo
        return camera

    def _first(self, role: Role) -> list[Any]:
        return self._first_on(self._topics[role])

    def _first_on(self, topic: str) -> list[Any]:
        messages = [message.content for message in islice(read_messages(self.path, [topic]), _FEW)]
        if not messages:
            raise DatasetError(f"{topic} holds no message")
        return messages

    def _own_robot(self) -> Robot | None:
        """The robot that our export writes into a bag."""
        if self._types.get(ros_encoding.ROBOT) != "std_msgs/msg/String":
            return None
        message = next(read_messages(self.path, [ros_encoding.ROBOT]), None)
        if message is None:
            return None
        where = f"{self.path}: {ros_encoding.ROBOT}"
        return check(Robot, mapping_of(message.content.data, where, DatasetError, keys_of(Robot)), where, DatasetError)

    def _read_frames(self, base: str | None, mounts: Mapping[str, str]) -> bag_rig.Frames:
        static = [
            topic for topic, kind in self._types.items() if topic.endswith("tf_static") and kind.endswith("TFMessage")
        ]
        transforms = [
            transform
            for message in islice(read_messages(self.path, static), _STATIC_MESSAGES)
            for transform in message.content.transforms
        ]
        topic = self._topics.get(Role.WHEEL_ODOMETRY)
        odometry = next(read_messages(self.path, [topic] if topic else []), None)
        child = odometry.content.child_frame_id.lstrip("/") if odometry else None
        try:
            return bag_rig.Frames(transforms, base, child, mounts)
        except DatasetError as error:
            raise DatasetError(f"{self.path}: /tf_static: {error}") from error

    def _true_pose(self, content: Any) -> FloatArray:
        match content.__msgtype__:
            case "nav_msgs/msg/Odometry":
                T = ros_decoding.pose_message(content.pose.pose)
                T_child_base = self._frames.T_child_base(content.child_frame_id)
                return T if T_child_base is None else T @ T_child_base
            case "geometry_msgs/msg/PoseStamped":
                return ros_decoding.pose_message(content.pose)
            case _:
                return ros_decoding.pose_message(content.transform)


@contextmanager
def _placed(path: Path, message: Message) -> Iterator[None]:
    """Say in which message of which bag something is wrong."""
    try:
        yield
    except DatasetError as error:
        at = message.recorded / NANOSECONDS
        raise DatasetError(f"{path}: {message.topic}, the message recorded at {at:.3f} s: {error}") from error
