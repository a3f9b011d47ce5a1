"""Trajectories out of ROS 1 bags, rosbag2 folders and MCAP files: the poses of one topic, stamped by their headers.

Opened and decoded as any recording is (`bag_access.py`): by the standard definitions of types, never by those that a
file brings along. A nav_msgs/Path holds a whole trajectory in every message: the longest counts. Of a TFMessage the
transforms of one child frame count, named behind the topic: `drive.bag:/tf:base_link`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from taskslam.datasets.bag_access import read_messages, topic_types
from taskslam.datasets.bag_files import SUFFIXES
from taskslam.datasets.ros_decoding import stamp_of
from taskslam.datasets.trajectory_checks import ReadTrajectory, checked_trajectory
from taskslam.errors import DatasetError, TrajectoryError
from taskslam.reading import is_file, is_folder, is_there
from taskslam.skipped import Skipped, too_many

POSES: dict[str, Callable[[Any], Any]] = {
    "nav_msgs/msg/Odometry": attrgetter("pose.pose.position", "pose.pose.orientation"),
    "geometry_msgs/msg/PoseStamped": attrgetter("pose.position", "pose.orientation"),
    "geometry_msgs/msg/PoseWithCovarianceStamped": attrgetter("pose.pose.position", "pose.pose.orientation"),
    "geometry_msgs/msg/TransformStamped": attrgetter("transform.translation", "transform.rotation"),
}
PATH, TREE = "nav_msgs/msg/Path", "tf2_msgs/msg/TFMessage"
_READ = (*POSES, PATH, TREE)


def is_bag(path: Path) -> bool:
    """Whether a path is a recording, by its name or by what lies in its folder."""
    if is_folder(path):
        return is_file(path / "metadata.yaml") or sum(file.suffix.lower() == ".db3" for file in path.iterdir()) == 1
    return path.suffix.lower() in SUFFIXES


def read_bag_trajectory(path: Path, topic: str | None = None) -> ReadTrajectory:
    """The poses of a topic; without one, of the only topic that has poses. topic: `/tf:base_link` for a child frame.

    Raises TrajectoryError: the file is damaged or no recording, the topic is not there or not of a type with a pose.
    """
    if not is_there(path):
        raise TrajectoryError(f"{path}: no such recording")
    try:
        chosen, frame, kind = _choose(path, topic, topic_types(path))
        skipped = Skipped()
        rows = _rows(path, chosen, frame, kind, skipped)
    except DatasetError as error:
        raise TrajectoryError(str(error)) from None
    bad = sum(skipped.counts.values())
    if too_many(bad, bad + len(rows)):
        raise TrajectoryError(f"{path}, {chosen}: {skipped.sentences()[0]}")
    notes = tuple(f"left out: {sentence}" for sentence in skipped.sentences())
    stamps = np.array([row[0] for row in rows], dtype=np.int64)
    numbers = np.array([row[1:] for row in rows], dtype=np.float64).reshape(-1, 7)
    return checked_trajectory(stamps, numbers[:, :3], numbers[:, 3:], lambda row: f"{path}, pose {row + 1}", notes)


def _rows(path: Path, topic: str, frame: str | None, kind: str, skipped: Skipped) -> list[tuple[float, ...]]:
    """Stamp in ns, position and quaternion x y z w of each pose."""
    rows: list[tuple[float, ...]] = []
    messages = read_messages(path, [topic], lambda _, error: skipped.add("messages that cannot be decoded", str(error)))
    for message in messages:
        try:
            found = [_row(*pose) for pose in _poses(message.content, kind, frame)]
        except DatasetError as error:
            skipped.add("messages that cannot be read", str(error))
            continue
        if kind == PATH:
            rows = max(rows, found, key=len)
        else:
            rows += found
    return rows


def _poses(content: Any, kind: str, frame: str | None) -> Iterator[tuple[Any, Any, Any]]:
    """The stamped message, position and rotation of each pose in a message."""
    if kind == PATH:
        for pose in content.poses:
            yield pose, *POSES["geometry_msgs/msg/PoseStamped"](pose)
    elif kind == TREE:
        for transform in content.transforms:
            if transform.child_frame_id.lstrip("/") == frame:
                yield transform, *POSES["geometry_msgs/msg/TransformStamped"](transform)
    else:
        yield content, *POSES[kind](content)


def _row(stamped: Any, position: Any, turn: Any) -> tuple[float, ...]:
    return (stamp_of(stamped), position.x, position.y, position.z, turn.x, turn.y, turn.z, turn.w)


def _choose(path: Path, topic: str | None, types: dict[str, str]) -> tuple[str, str | None, str]:
    """The topic to read, a child frame, and the topic's type. Raises TrajectoryError with what is there."""
    usable = sorted(name for name, kind in types.items() if kind in (*POSES, PATH))
    if topic is None and len(usable) == 1:
        return usable[0], None, types[usable[0]]
    frame = None
    if topic is not None and topic not in types and ":" in topic:
        topic, _, frame = topic.rpartition(":")
    if topic in types and types[topic] not in _READ:
        kinds = ", ".join(kind.rpartition("/")[2] for kind in _READ)
        raise TrajectoryError(f"{path}: {topic} is of type {types[topic]}, which is not read; expected one of {kinds}")
    if topic in types and types[topic] == TREE and not frame:
        frames = sorted(
            {t.child_frame_id.lstrip("/") for m in read_messages(path, [topic]) for t in m.content.transforms}
        )
        known = ", ".join(frames[:10])
        raise TrajectoryError(f"{path}: {topic} holds the frames {known}; name one, FILE:{topic}:FRAME")
    if topic in types:
        return topic, frame, types[topic]
    there = ", ".join(usable) if usable else f"none (it has {', '.join(sorted(types)[:10]) or 'no topics'})"
    trees = [name for name, kind in types.items() if kind == TREE]
    there += f"; of {trees[0]}, a frame can be named, FILE:{trees[0]}:FRAME" if trees else ""
    what = "name the topic, FILE:TOPIC" if topic is None else f"no topic {topic}"
    raise TrajectoryError(f"{path}: {what}; topics with poses: {there}")
