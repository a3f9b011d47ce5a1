"""Trajectories out of ROS 1 bags, rosbag2 folders and MCAP files: the poses of one topic, stamped by their headers.

Messages are read by the standard definitions of their types, never by those that a file brings along.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from taskslam.datasets.bag_files import BagPath, check_bag_files
from taskslam.datasets.trajectory_checks import ReadTrajectory, checked_trajectory
from taskslam.errors import TrajectoryError
from taskslam.measurements import NANOSECONDS
from taskslam.reading import is_file, is_there

POSES: dict[str, Callable[[Any], Any]] = {
    "nav_msgs/msg/Odometry": attrgetter("pose.pose.position", "pose.pose.orientation"),
    "geometry_msgs/msg/PoseStamped": attrgetter("pose.position", "pose.orientation"),
    "geometry_msgs/msg/PoseWithCovarianceStamped": attrgetter("pose.pose.position", "pose.pose.orientation"),
    "geometry_msgs/msg/TransformStamped": attrgetter("transform.translation", "transform.rotation"),
}
_SUFFIXES = {".bag", ".mcap", ".db3"}


def is_bag(path: Path) -> bool:
    """Whether a path is a recording, by its name or by the metadata in its folder."""
    return path.suffix.lower() in _SUFFIXES or is_file(path / "metadata.yaml")


def read_bag_trajectory(path: Path, topic: str | None = None) -> ReadTrajectory:
    """The poses of a topic; without one, of the only topic that has poses.

    Raises TrajectoryError: the file is damaged or no recording, the topic is not there or not of a type with a pose.
    """
    if not is_there(path):
        raise TrajectoryError(f"{path}: no such recording")
    check_bag_files(path, TrajectoryError)
    try:
        rows = _rows(path, topic)
    except TrajectoryError:
        raise
    except Exception as error:
        # rosbags raises whatever a damaged file provokes: its own errors, struct, sqlite, decompression, unicode.
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise TrajectoryError(f"{path}: damaged, or no recording that can be read: {reason}") from None
    stamps = np.array([row[0] for row in rows], dtype=np.int64)
    numbers = np.array([row[1:] for row in rows], dtype=np.float64).reshape(-1, 7)
    return checked_trajectory(stamps, numbers[:, :3], numbers[:, 3:], lambda row: f"{path}, pose {row + 1}")


def _rows(path: Path, topic: str | None) -> list[tuple[float, ...]]:
    """Stamp in ns, position and quaternion x y z w of each message."""
    from rosbags.rosbag1 import Reader as Ros1Reader
    from rosbags.rosbag2 import Reader as Ros2Reader
    from rosbags.typesys import Stores, get_typestore

    ros1 = path.suffix.lower() == ".bag" and is_file(path)
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_JAZZY)
    rows: list[tuple[float, ...]] = []
    with (Ros1Reader if ros1 else Ros2Reader)(BagPath(path)) as reader:
        chosen = _choose(path, topic, {link.topic: link.msgtype for link in reader.connections})
        links = [link for link in reader.connections if link.topic == chosen]
        for link, _, data in reader.messages(links):
            decode = store.deserialize_ros1 if ros1 else store.deserialize_cdr
            try:
                message: Any = decode(data, link.msgtype)
                position, turn = POSES[link.msgtype](message)
            except (AssertionError, struct.error, IndexError, ValueError) as error:
                raise TrajectoryError(
                    f"{path}, {chosen}, message {len(rows) + 1}: cannot be decoded: {error}"
                ) from None
            stamp = message.header.stamp
            rows.append(
                (stamp.sec * NANOSECONDS + stamp.nanosec,
                 position.x, position.y, position.z, turn.x, turn.y, turn.z, turn.w)
            )  # fmt: skip
    return rows


def _choose(path: Path, topic: str | None, types: dict[str, str]) -> str:
    """The topic to read. Raises TrajectoryError with what is there."""
    usable = sorted(name for name, kind in types.items() if kind in POSES)
    if topic is None and len(usable) == 1:
        return usable[0]
    if topic in types and types[topic] not in POSES:
        kinds = ", ".join(kind.rpartition("/")[2] for kind in POSES)
        raise TrajectoryError(f"{path}: {topic} is of type {types[topic]}, which is not read; expected one of {kinds}")
    if topic in types:
        return topic
    there = ", ".join(usable) if usable else f"none (it has {', '.join(sorted(types)[:10]) or 'no topics'})"
    what = "name the topic, FILE:TOPIC" if topic is None else f"no topic {topic}"
    raise TrajectoryError(f"{path}: {what}; topics with poses: {there}")
