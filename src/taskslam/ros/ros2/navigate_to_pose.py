"""Nav2's action NavigateToPose, over the bridge. nav2_msgs are those of the user's ROS, or made by `messages.py`."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from taskslam.geometry import SE2
from taskslam.ros.errors import RejectedError, RosError
from taskslam.ros.navigation import End, NavigationStack
from taskslam.ros.ros2.client import Goal, Ros2
from taskslam.ros.transport import Heard

KIND = "nav2_msgs/action/NavigateToPose"
_ACCEPT_S = 10.0


class NavigateToPose(NavigationStack):
    """One goal at a time. behavior_tree: the file of another tree than the stack's own, on its machine."""

    topics: Mapping[str, str] = {}

    def __init__(self, ros: Ros2, action: str, behavior_tree: str = "") -> None:
        self._ros, self.action, self._tree = ros, action, behavior_tree
        self._errand: _Errand | None = None

    def offered(self) -> bool:
        """Whether there is an action server."""
        return f"{self.action}/_action/status" in self._ros.graph().publishers

    def send(self, frame: str, goal: SE2) -> None:
        """Drive there. The stamp stays 0: `the latest`, to a frame that the stack itself plans in."""
        turned = {"z": math.sin(goal.theta / 2), "w": math.cos(goal.theta / 2)}
        pose = {"position": {"x": goal.x, "y": goal.y}, "orientation": turned}
        fields: dict[str, Any] = {"pose": {"header": {"frame_id": frame}, "pose": pose}, "behavior_tree": self._tree}
        self._errand = _Errand(self._ros, self.action, fields)

    def ended(self) -> End | None:
        """How it ended."""
        return self._errand.end if self._errand else None

    def cancel(self) -> None:
        """Also before it was accepted."""
        if self._errand is not None:
            self._errand.cancel()

    def take(self, heard: Heard) -> None:
        """It hears no topics."""


class _Errand:
    """A goal from its sending to its end, in a thread of its own: acceptance may take seconds, and INT must not."""

    def __init__(self, ros: Ros2, action: str, fields: dict[str, Any]) -> None:
        self._ros, self._lock, self._canceled = ros, threading.Lock(), False
        self.end: End | None = None
        self._goal: Goal | None = None
        threading.Thread(target=self._run, args=(action, fields), name="waits for a goal", daemon=True).start()

    def cancel(self) -> None:
        with self._lock:
            asked, self._canceled = self._canceled, True
            goal = self._goal
        if goal is not None and not asked and self.end is None:
            threading.Thread(target=self._ask_to_cancel, args=(goal,), daemon=True).start()

    def _run(self, action: str, fields: dict[str, Any]) -> None:
        try:
            goal = self._ros.send_goal(action, KIND, fields, within_s=_ACCEPT_S)
        except RosError as error:
            self.end = End("rejected" if isinstance(error, RejectedError) else "gone", text=str(error))
            return
        with self._lock:
            self._goal, canceled = goal, self._canceled
        if canceled:
            self._ask_to_cancel(goal)
        try:
            result = goal.result.result()
        except RosError as error:
            self.end = End("gone", text=str(error))
            return
        code, text = result.values.get("error_code"), result.values.get("error_msg", "")
        self.end = End(result.status, code, text)

    def _ask_to_cancel(self, goal: Goal) -> None:
        with suppress(RosError):
            self._ros.cancel(goal)
