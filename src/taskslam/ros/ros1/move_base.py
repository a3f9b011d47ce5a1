"""move_base as ROS 1 has it: an action over five topics (actionlib), of which we publish two and hear two."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

from rosbags.typesys import get_types_from_msg
from rosbags.typesys.store import Typestore

from taskslam.datasets.ros_encoding import RosEncoder
from taskslam.geometry import SE2
from taskslam.ros.navigation import End, NavigationStack
from taskslam.ros.transport import Heard, Transport

_PACKAGE = "move_base_msgs/msg/MoveBase"
_HEADER = "std_msgs/Header header\n"
_TYPES = {
    "Goal": "geometry_msgs/PoseStamped target_pose\n",
    "Result": "",
    "ActionGoal": f"{_HEADER}actionlib_msgs/GoalID goal_id\nmove_base_msgs/MoveBaseGoal goal\n",
    "ActionResult": f"{_HEADER}actionlib_msgs/GoalStatus status\nmove_base_msgs/MoveBaseResult result\n",
}
_CANCEL = "actionlib_msgs/msg/GoalID"
_STATUS = "actionlib_msgs/msg/GoalStatusArray"
_ENDS = {2: "canceled", 3: "succeeded", 4: "aborted", 5: "rejected", 8: "canceled", 9: "unknown"}


def know_move_base(store: Typestore) -> None:
    """Let a typestore know the messages of move_base."""
    for name, text in _TYPES.items():
        if _PACKAGE + name not in store.types:
            store.register(get_types_from_msg(text, _PACKAGE + name))


class MoveBase(NavigationStack):
    """One goal at a time."""

    def __init__(self, transport: Transport, action: str) -> None:
        know_move_base(transport.store)
        self._transport, self.action, self._encoder = transport, action, RosEncoder(transport.store)
        self._status, self._result = f"{action}/status", f"{action}/result"
        self.topics: Mapping[str, str] = {self._status: _STATUS, self._result: _PACKAGE + "ActionResult"}
        transport.advertise(f"{action}/goal", _PACKAGE + "ActionGoal")
        transport.advertise(f"{action}/cancel", _CANCEL)
        self._numbers = itertools.count(1)
        self._id: Any = None
        self._end: End | None = None

    def offered(self) -> bool:
        """Whether somebody reads our goals and tells of their states."""
        return bool(self._transport.readers(f"{self.action}/goal") and self._transport.writers(self._status))

    def send(self, frame: str, goal: SE2) -> None:
        """Drive there."""
        new = self._encoder.new
        self._end = None
        self._id = new(_CANCEL, stamp=self._encoder.time(0), id=f"taskslam-{next(self._numbers)}")
        target = new(_PACKAGE + "Goal", target_pose=self._encoder.pose_stamped(0, frame, goal))
        header = self._encoder.header(0, "")
        message = new(_PACKAGE + "ActionGoal", header=header, goal_id=self._id, goal=target)
        self._transport.publish(f"{self.action}/goal", message)

    def ended(self) -> End | None:
        """How it ended; its server's connections tell when that has died."""
        if self._end is None and self._id is not None and not self.offered():
            self._end = End("gone")
        return self._end

    def cancel(self) -> None:
        """By its id."""
        if self._id is not None and self._end is None:
            self._transport.publish(f"{self.action}/cancel", self._id)

    def take(self, heard: Heard) -> None:
        """The result of our goal."""
        if heard.topic != self._result or self._id is None:
            return
        status = heard.content.status
        if status.goal_id.id == self._id.id and self._end is None:
            self._end = End(_ENDS.get(status.status, "unknown"), text=str(status.text))
