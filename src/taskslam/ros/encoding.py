"""Measurements as a node is told them: the messages of recordings, under its own names, on its own clock."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from rosbags.typesys.store import Typestore

from taskslam.datasets import ros_decoding
from taskslam.datasets.bag_sensor import frames_of, messages_of
from taskslam.datasets.ros_encoding import BASE, MAP, ODOM, RosEncoder
from taskslam.errors import DatasetError, InputError, did_you_mean
from taskslam.geometry import SE2, FloatArray, invert_se3
from taskslam.measurements import NANOSECONDS, Measurement, PointCloud, WheelOdometry
from taskslam.robot import SensorRig
from taskslam.ros.lockstep import Answer as Said
from taskslam.ros.node_file import Answer, Extrinsic, Intrinsic
from taskslam.sensors import sensor_kind
from taskslam.slam.base import InvalidOutputError

EPOCH = 1_000 * NANOSECONDS
"""What a node's clock shows at our t = 0: to ROS, the time 0 means "not yet" or "the latest"."""

_PLANAR = np.array([0, 1, 5])  # x, y and yaw among x y z roll pitch yaw


@dataclass(frozen=True, slots=True)
class Utterance:
    """A measurement as it is said. stamp: its instant; bears: the stamp of its messages' header, ns of our time."""

    stamp: int
    bears: int
    messages: tuple[tuple[str, Any], ...]


class NodeEncoder(RosEncoder):
    """Builds a node's messages: frames by the names that it has for them, stamps on its clock."""

    def __init__(self, store: Typestore, rig: SensorRig, frames: Mapping[str, str], clouds_from: str = "last") -> None:
        super().__init__(store)
        self._rig, self._frames = rig, frames
        self._from_the_first = clouds_from == "first"
        self.mounted = dict(frames_of(rig))
        known = [BASE, ODOM, MAP, *self.mounted]
        for frame in frames:
            if frame not in known:
                raise InputError(
                    f"frames: '{frame}' is none of this robot's; expected one of {', '.join(known)}."
                    f"{did_you_mean(frame, known)}"
                )

    def time(self, stamp: int) -> Any:
        """An instant of ours (ns) on the node's clock."""
        return super().time(stamp + EPOCH)

    def frame(self, name: str) -> str:
        """What the node calls one of our frames."""
        return self._frames.get(name, name)

    def utterance(self, measurement: Measurement) -> Utterance:
        """All messages of a measurement, by our topics."""
        told = measurement
        if self._from_the_first and isinstance(measurement, PointCloud):
            told = _as_fired(measurement)
        messages = tuple((topic, message) for topic, _, message in messages_of(self, self._rig, told))
        bears = stamp_of(messages[-1][1]) if messages else measurement.stamp
        return Utterance(measurement.stamp, bears, messages)

    def in_base(self, frame: str) -> FloatArray:
        """(4, 4) pose of one of our frames in the base. Raises InputError: there is no such frame."""
        if frame == BASE:
            return np.eye(4)
        if frame not in self.mounted:
            known = [BASE, *self.mounted]
            raise InputError(
                f"the frame '{frame}' is none of this robot's; expected one of {', '.join(known)}."
                f"{did_you_mean(frame, known)}"
            )
        return self.mounted[frame]

    def extrinsic(self, wanted: Extrinsic) -> list[Any]:
        """How one of our frames lies in another, as a parameter. Raises InputError: there is no such frame."""
        T = invert_se3(self.in_base(wanted.seen_from)) @ self.in_base(wanted.of)
        match wanted.what:
            case "xyz":
                part: FloatArray = T[:3, 3]
            case "rotation":
                part = T[:3, :3].ravel()
            case "matrix":
                part = T.ravel()
            case _:
                part = T
        listed: list[Any] = part.tolist()
        return listed

    def intrinsic(self, wanted: Intrinsic) -> list[Any]:
        """What a camera is, as a parameter. Raises InputError: the robot has no such camera."""
        kind = sensor_kind(wanted.of)
        camera = kind.part_of(self._rig)
        if camera is None:
            raise InputError(f"the robot has no {kind.words}, whose {wanted.what} the node is to be told")
        if wanted.what == "resolution":
            return [camera.width, camera.height]
        return [camera.focal_length, camera.focal_length, *camera.center]


class Odometer:
    """What wheel odometry has said: where the base is in `odom` now, a little later, and at instants that were told."""

    _MOST = 4096

    def __init__(self) -> None:
        self.newest: WheelOdometry | None = None
        self._told: dict[int, SE2] = {}

    def at(self, stamp: int) -> SE2 | None:
        """The base at an instant, its last velocities going on; None before any odometry, or where it is older."""
        if self.newest is None or stamp < self.newest.stamp:
            return None
        seconds = (stamp - self.newest.stamp) / NANOSECONDS
        at = self.newest.T_odom_base
        if seconds > 0:
            at = at @ _arc(self.newest.linear * seconds, self.newest.angular * seconds)
        self._told[stamp] = at
        if len(self._told) > self._MOST:
            del self._told[next(iter(self._told))]
        return at

    def told(self, stamp: int) -> SE2 | None:
        """What was told of an instant, or of the last one before it."""
        return next((at for when, at in reversed(self._told.items()) if when <= stamp), None)


class PoseReader:
    """From what a node says to our poses (4, 4): `T_start_base`. Raises InvalidOutputError for what is no pose."""

    def __init__(self, answer: Answer, encoder: NodeEncoder, odometer: Odometer) -> None:
        self._answer, self._odometer = answer, odometer
        self._world = answer.world
        self._names = tuple(map(encoder.frame, answer.transform)) if answer.transform else ()
        self._in_odom = answer.of == ODOM
        self._T_base_of = np.eye(4) if self._in_odom else encoder.in_base(answer.of)
        self._first: FloatArray | None = None

    def read(self, message: Any) -> Said | None:
        """What a message says, or None where it says nothing of the answer."""
        if self._answer.transform is None:
            return self._said(message, *_pose_in(message))
        for transform in message.transforms:
            if (transform.header.frame_id.lstrip("/"), transform.child_frame_id.lstrip("/")) == self._names:
                return self._said(transform, transform.transform, None)
        return None

    def _said(self, message: Any, pose: Any, covariance: FloatArray | None) -> Said:
        frame = message.header.frame_id.lstrip("/")
        if self._world and frame != self._world:
            raise InvalidOutputError(f"a pose in the frame '{frame}'; expected '{self._world}'")
        try:
            stamp = stamp_of(message) - round(self._answer.ahead * NANOSECONDS)
            T = ros_decoding.pose_message(pose)
        except DatasetError as error:
            raise InvalidOutputError(str(error)) from None
        return Said(stamp, self._since_start(stamp, T), covariance if self._plain else None)

    @property
    def _plain(self) -> bool:
        """Whether the node's pose is ours as it is, and so is its covariance."""
        return self._answer.origin == "base" and self._answer.of == BASE

    def _since_start(self, stamp: int, T_world_of: FloatArray) -> FloatArray:
        if self._plain:
            return T_world_of
        if self._in_odom:
            at = self._odometer.told(stamp)
            return T_world_of if at is None else T_world_of @ at.matrix()
        if self._first is None:
            self._first = T_world_of
        T_of_base = invert_se3(self._T_base_of)
        match self._answer.origin:
            case "base":
                return T_world_of @ T_of_base
            case "of":
                return self._T_base_of @ T_world_of @ T_of_base
            case _:
                return self._T_base_of @ invert_se3(self._first) @ T_world_of @ T_of_base


def stamp_of(message: Any) -> int:
    """The header's stamp on our clock, ns."""
    return ros_decoding.stamp_of(message) - EPOCH


def unknown_frames(parameters: Mapping[str, Any], known: Collection[str]) -> Iterable[str]:
    """A sentence for each parameter that seems to name a frame that nobody tells the node of."""
    for name, value in parameters.items():
        if name.endswith(("frame", "frame_id")) and isinstance(value, str) and value.lstrip("/") not in known:
            hint = did_you_mean(value, known)
            yield f"the parameter {name} names the frame '{value}'; it is told of {', '.join(sorted(known))}.{hint}"


def _as_fired(cloud: PointCloud) -> PointCloud:
    """A cloud in the order of firing, stamped with its first, as drivers give it to nodes that straighten turns."""
    order = np.argsort(cloud.time_offset, kind="stable")
    first = int(cloud.time_offset.min(initial=0))
    return PointCloud(
        cloud.stamp + first, cloud.points[order], cloud.ring[order], cloud.time_offset[order] - np.int32(first)
    )


def _pose_in(message: Any) -> tuple[Any, FloatArray | None]:
    """The pose or transform of a message, and its covariance (3, 3) over x, y, yaw, where it has one."""
    if hasattr(message, "transform"):
        return message.transform, None
    inner = message.pose
    if not hasattr(inner, "covariance"):
        return inner, None
    covariance = np.asarray(inner.covariance, np.float64).reshape(6, 6)[np.ix_(_PLANAR, _PLANAR)]
    return inner.pose, covariance if covariance.any() else None


def _arc(distance: float, turn: float) -> SE2:
    """Where a base gets that goes so far while it turns by so much."""
    if abs(turn) < 1e-9:
        return SE2(distance, 0.0, turn)
    radius = distance / turn
    return SE2(radius * math.sin(turn), radius * (1.0 - math.cos(turn)), turn)
