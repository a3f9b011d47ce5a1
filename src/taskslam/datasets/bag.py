"""`Bag`: a ROS 1 bag, ROS 2 bag or MCAP as a dataset.

Sensors are found by the types of the topics (`bag_topics.py`), their places by /tf_static. The rig is the one that our
own export writes into the bag, or that of a robot file, or follows from the messages (`bag_rig.py`). Measurements come
in the order of their own stamps, not of their recording.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from taskslam.datasets import bag_rig, ros_decoding, ros_encoding
from taskslam.datasets.bag_access import Message, read_heads, read_messages, topic_types
from taskslam.datasets.bag_sensor import BagSensor, bag_sensor
from taskslam.datasets.bag_topics import TRUTH_ROLE, choose_topics
from taskslam.datasets.dataset import Dataset, TruthPose
from taskslam.datasets.share import Share
from taskslam.datasets.stamp_order import Pairing, in_stamp_order
from taskslam.errors import DatasetError
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS, Measurement, Sensor
from taskslam.robot import Robot, SensorRig, load_robot
from taskslam.sensors import SensorKind, sensor_kind, sensor_kinds
from taskslam.user_files import check, complaint, keys_of, mapping_of

_FEW = 5
_STATIC_MESSAGES = 1000


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
        self._heads = read_heads(path, self._wanted_heads())
        robot = robot or self._own_robot()
        self.frames = self._read_frames(base_frame, mounts)
        given = robot.rig if robot else None
        self._sensors: dict[Sensor, BagSensor] = {}
        parts: dict[str, Any] = {}
        for kind in sensor_kinds():
            part = kind.part_of(given) if given else None
            if kind.bag and (found := self._read(kind, part, unclear)):
                self._sensors[kind.sensor] = found
                parts[kind.field] = found.part
        parts.setdefault("odometry", (given or load_robot("turtlebot2").rig).odometry)
        self.sensors = frozenset(self._sensors)
        self.rig = SensorRig.model_validate(parts)

    def measurements(self, sensors: Collection[Sensor]) -> Iterator[Measurement]:
        """What these sensors said; see `Dataset`."""
        wanted = self.sensors.intersection(sensors)
        return in_stamp_order(self._decoded(wanted), self.skipped)

    def truth(self) -> Iterator[TruthPose]:
        """The poses of the truth topic, in its own world frame; one out of order is left out and counted."""
        topic = self._topics.get(TRUTH_ROLE)
        newest = -1
        share = Share(self.skipped, "true poses that cannot be read")
        for message in read_messages(self.path, [topic] if topic else [], lambda _, error: share.skip("", error)):
            with share.of(_where(self.path, message)):
                stamp, T = ros_decoding.stamp_of(message.content), self._true_pose(message.content)
            if share.failed:
                continue
            if stamp <= newest:
                self.skipped.add("true poses out of order")
                continue
            newest = stamp
            yield TruthPose(stamp, T)
        share.end()

    def topic(self, role: str) -> str:
        """The topic of a role."""
        return self._topics[role]

    def has(self, topic: str) -> bool:
        """Whether there is such a topic."""
        return topic in self._types

    def note(self, sentence: str) -> None:
        """Say what was guessed of this recording, or not believed."""
        self.notes.append(sentence)

    def first(self, topic: str) -> list[Any]:
        """The first messages of a topic. Raises DatasetError where there is none."""
        if not (messages := self._head(topic)):
            raise DatasetError(f"{topic} holds no message")
        return messages

    def _wanted_heads(self) -> dict[str, int]:
        """How many first messages of which topics tell the robot, the frames and the sensors."""
        told = {*self._topics.values(), *(topic for topic, kind in self._types.items() if kind.endswith("/CameraInfo"))}
        return (
            dict.fromkeys(sorted(told), _FEW)
            | {ros_encoding.ROBOT: 1}
            | dict.fromkeys(self._static(), _STATIC_MESSAGES)
        )

    def _head(self, topic: str) -> list[Any]:
        head = self._heads.get(topic, [])
        if isinstance(head, DatasetError):
            raise head
        return head

    def _static(self) -> list[str]:
        return [
            topic for topic, kind in self._types.items() if topic.endswith("tf_static") and kind.endswith("TFMessage")
        ]

    def _read(self, kind: SensorKind, given: Any, unclear: Mapping[str, str]) -> BagSensor | None:
        """A sensor of the table, if its topics are known and its place and kind can be told; else says why not."""
        roles = _roles(kind)
        if not all(role in self._topics for role in roles):
            if reasons := [unclear[role] for role in roles if role in unclear]:
                self.why_not[kind.sensor] = reasons[0]
            return None
        try:
            return bag_sensor(kind)(self, given)
        except (DatasetError, ValidationError) as error:
            self.why_not[kind.sensor] = complaint(error) if isinstance(error, ValidationError) else str(error)
            return None

    def _decoded(self, sensors: Collection[Sensor]) -> Iterator[Measurement]:
        pairings = {sensor: Pairing(self.skipped) for sensor in sensors}
        heard = {self._topics[role]: (role, sensor) for sensor in sensors for role in _roles(sensor_kind(sensor))}
        shares = {topic: Share(self.skipped, f"messages of {topic} that cannot be read") for topic in heard}
        for message in read_messages(self.path, heard, lambda message, error: shares[message.topic].skip("", error)):
            role, sensor = heard[message.topic]
            measurement = None
            with shares[message.topic].of(_where(self.path, message)):
                measurement = self._sensors[sensor].measurement(role, message.content, pairings[sensor])
            if measurement is not None:
                yield measurement
        for share in shares.values():
            share.end()
        for pairing in pairings.values():
            pairing.end()

    def _own_robot(self) -> Robot | None:
        """The robot that our export writes into a bag."""
        if self._types.get(ros_encoding.ROBOT) != "std_msgs/msg/String":
            return None
        if not (head := self._head(ros_encoding.ROBOT)):
            return None
        where = f"{self.path}: {ros_encoding.ROBOT}"
        return check(Robot, mapping_of(head[0].data, where, DatasetError, keys_of(Robot)), where, DatasetError)

    def _read_frames(self, base: str | None, mounts: Mapping[str, str]) -> bag_rig.Frames:
        transforms = [
            transform for topic in self._static() for content in self._head(topic) for transform in content.transforms
        ]
        odometry = self._head(self._topics.get("wheel_odometry", ""))
        child = odometry[0].child_frame_id.lstrip("/") if odometry else None
        try:
            return bag_rig.Frames(transforms, base, child, mounts)
        except DatasetError as error:
            raise DatasetError(f"{self.path}: /tf_static: {error}") from error

    def _true_pose(self, content: Any) -> FloatArray:
        match content.__msgtype__:
            case "nav_msgs/msg/Odometry":
                T = ros_decoding.pose_message(content.pose.pose)
                T_child_base = self.frames.T_child_base(content.child_frame_id)
                return T if T_child_base is None else T @ T_child_base
            case "geometry_msgs/msg/PoseStamped":
                return ros_decoding.pose_message(content.pose)
            case _:
                return ros_decoding.pose_message(content.transform)


def _where(path: Path, message: Message) -> str:
    return f"{path}: {message.topic}, the message recorded at {message.recorded / NANOSECONDS:.3f} s"


def _roles(kind: SensorKind) -> list[str]:
    return [topic.role for topic in kind.topics if topic.role]
