"""Waypoints from the goals that a person gives in RViz (2D Goal Pose), as `{x, y, yaw}` YAML: a `waypoints_file`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from taskslam.datasets import ros_decoding
from taskslam.datasets.ros_encoding import MAP
from taskslam.errors import DatasetError, InputError
from taskslam.files import write_whole
from taskslam.geometry import SE2
from taskslam.ros.transport import Heard, Transport
from taskslam.stopping import StoppedError, undisturbed

TOPICS = {1: "/move_base_simple/goal", 2: "/goal_pose"}
"""Where RViz says them, by the version of ROS."""

_KIND = "geometry_msgs/msg/PoseStamped"
_LOOK_EVERY_S = 0.2


def collect_goals(transport: Transport, topic: str, out: Path, count: int | None, tell: Callable[[str], None]) -> int:
    """Write every goal that is given into `out`, until there are so many or a signal asks to end; how many there are.

    After each the file is whole. tell: of each, and of what is no goal. Raises InputError: `out` exists.
    """
    if out.exists():
        raise InputError(f"{out} exists; expected the name of a new file")
    goals: list[SE2] = []
    transport.subscribe(topic, _KIND)
    tell(f"give goals on {topic}, in the frame {MAP}; Ctrl-C ends")
    try:
        while count is None or len(goals) < count:
            for heard in transport.hear(_LOOK_EVERY_S):
                with undisturbed():
                    _take(heard, goals, out, tell)
    except StoppedError:
        pass  # that is how a person ends it
    return len(goals)


def _take(heard: Heard, goals: list[SE2], out: Path, tell: Callable[[str], None]) -> None:
    frame = heard.content.header.frame_id.lstrip("/")
    try:
        pose = SE2.from_matrix(ros_decoding.pose_message(heard.content.pose))
    except DatasetError as error:
        tell(f"{error}: left out")
        return
    if frame != MAP:
        tell(f"a goal in the frame '{frame}': left out; expected '{MAP}' (RViz: Fixed Frame)")
        return
    goals.append(pose)
    rows = [f"- {{x: {goal.x:.3f}, y: {goal.y:.3f}, yaw: {goal.theta:.4f}}}\n" for goal in goals]
    write_whole(out, "".join(rows))
    tell(f"goal {len(goals)}: {pose.in_words()}")
