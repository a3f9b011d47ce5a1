"""Connections: what there is to say of a robot's ROS graph so that a tour can be driven on it (`--connection FILE`).

    topics: {/scan: /front/scan, /cmd_vel: /mobile_base/commands/velocity}
    base: base_link
    limits: {linear: 0.3, angular: 1.0}
    stop: /emergency_stop

A robot whose topics bear our names needs none. What every key means stands at `Connection`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from taskslam.errors import InputError, did_you_mean
from taskslam.field_types import Positive
from taskslam.ros import names
from taskslam.ros.node_file import Text, Topic
from taskslam.sensors import sensor_kinds
from taskslam.user_files import read_model


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class SpeedLimits(_Part):
    """No command is faster, ahead (m/s) or turning (rad/s): a faster one is scaled as a whole."""

    linear: Positive = 0.5
    angular: Positive = 1.5


class StackFile(_Part):
    """The robot's own navigation, which drives with `--drive nav2` or `move_base`.

    name: by which results call it, as a method. action: by default /navigate_to_pose of Nav2, /move_base of move_base.
    map: the frame in which it plans. behavior_tree: Nav2's, another than its own. cancel: s; so long it has to end a
    goal that is given up.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z][\w-]*$")] | None = None
    action: Topic | None = None
    map: Text = "map"
    behavior_tree: str = ""
    cancel: Positive = 5.0


class Connection(_Part):
    """A robot's graph.

    graph: where it is found, the URI of its roscore or the number of its domain; by default as ROS_MASTER_URI or
    ROS_DOMAIN_ID say. setup: a script of your ROS 2, whose Python then runs our bridge. topics: names of ours that the
    robot has under others. base: the base's frame; by default base_footprint or base_link, whichever there is. limits:
    of speed. stop: a topic of std_msgs/Bool that says true while the stop button is pressed; it must be there and not
    be pressed. fresh: s; where the newest odometry or our newest command is older, the robot is told to stand. look: s
    on the wall's clock, so long the dry run listens. clock: s, by which the robot's stamps may differ from our time.
    to_start: how the robot comes to the start between rounds without map: a `person` brings it, or it is the last
    round's `goal`. stack: the robot's own navigation.
    """

    graph: str = ""
    setup: Text | None = None
    topics: dict[Topic, Topic] = {}
    base: Text | None = None
    limits: SpeedLimits = SpeedLimits()
    stop: Topic | None = None
    fresh: Annotated[float, Field(ge=0.1, le=5.0)] = 0.5
    look: Annotated[float, Field(ge=0.5, le=60.0)] = 3.0
    clock: Positive = 0.2
    to_start: Literal["person", "goal"] = "person"
    stack: StackFile = StackFile()

    @field_validator("topics")
    @classmethod
    def _of_ours(cls, topics: dict[str, str]) -> dict[str, str]:
        known = [*(topic.name for kind in sensor_kinds() for topic in kind.topics), *names.KINDS]
        for topic in topics:
            if topic not in known:
                hint = did_you_mean(topic, known)
                raise ValueError(f"{topic} is none of ours; expected one of {', '.join(known)}.{hint}")
        return topics

    def theirs(self, topic: str) -> str:
        """What the robot calls a topic of ours."""
        return self.topics.get(topic, topic)


def load_connection(path: Path) -> Connection:
    """A connection's file. Raises InputError naming the key."""
    return read_model(path, Connection, "connection", InputError)
