"""`NavigationStack`: somebody's navigation as we ask it for one goal after the other, and how its endings are ours.

Nav2 (`ros2/navigate_to_pose.py`) and move_base (`ros1/move_base.py`) are such stacks. What differs between
distributions is not asked for: Humble tells no reason, Jazzy a code, Kilted a code and a sentence.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.ros.transport import Heard


@dataclass(frozen=True, slots=True)
class End:
    """How a goal ended.

    status: succeeded, aborted, canceled, rejected, gone (whoever drove to it), or unknown. code: of Nav2's, None where
    none is told; text: what was said with it.
    """

    status: str
    code: int | None = None
    text: str = ""


class NavigationStack(Protocol):
    """Somebody's navigation. topics: what it must be told of by `take`, with their types; action: its name."""

    action: str
    topics: Mapping[str, str]

    def offered(self) -> bool:
        """Whether somebody takes goals."""

    def send(self, frame: str, goal: SE2) -> None:
        """Have it drive to a goal in one of its frames. Returns at once; how it ended is told by `ended`."""

    def ended(self) -> End | None:
        """How the last goal ended, or None while it is under way."""

    def cancel(self) -> None:
        """Ask for the last goal to be given up, if it is under way. Returns at once, never raises."""

    def take(self, heard: Heard) -> None:
        """What was heard on one of its topics."""


_CONTROLLER = {
    100: "unknown",
    101: "no such controller",
    102: "a transform is missing or too old",
    103: "the path is not valid",
    104: "out of patience",
    105: "no progress",
    106: "no valid command",
    107: "timed out",
}
_PLANNER = {
    200: "unknown",
    201: "no such planner",
    202: "a transform is missing or too old",
    203: "the start is outside the map",
    204: "the goal is outside the map",
    205: "the start is occupied",
    206: "the goal is occupied",
    207: "timed out",
    208: "there is no valid path",
}
_NAVIGATOR = {
    9000: "unknown",
    9001: "the behavior tree cannot be loaded",
    9002: "a transform is missing or too old",
    9003: "timed out",
}
"""Constants of nav2_msgs, FollowPath, ComputePathToPose and NavigateToPose, Jazzy and Kilted."""

_OUTCOMES = {
    102: Outcome.LOST,
    105: Outcome.OSCILLATION,
    202: Outcome.LOST,
    9002: Outcome.LOST,
    9003: Outcome.GOAL_TIMEOUT,
}
_TEXTS = {"valid plan": Outcome.NO_PLAN, "oscillating": Outcome.OSCILLATION}
"""What move_base says of a goal that it gave up; anything else is its controller."""


def judged(end: End) -> tuple[Outcome, str]:
    """Our outcome of a goal that ended so, and why in words."""
    said = f': "{end.text}"' if end.text else ""
    match end.status:
        case "succeeded":
            return Outcome.REACHED, end.text
        case "rejected":
            return Outcome.NO_PLAN, f"the goal was not accepted{said}"
        case "gone":
            return Outcome.CRASHED, f"whoever drove to the goal is gone{said}"
        case "canceled":
            return Outcome.NO_CONTROL, f"somebody else canceled the goal{said}"
    if end.code:
        outcome = _OUTCOMES.get(end.code, Outcome.NO_PLAN if end.code in _PLANNER else Outcome.NO_CONTROL)
        return outcome, f"{end.status} with error code {end.code}{_words(end.code)}{said}"
    outcome = next((outcome for part, outcome in _TEXTS.items() if part in end.text), Outcome.NO_CONTROL)
    return outcome, f"{end.status}{said or ', and no reason is told'}"


def _words(code: int) -> str:
    for who, codes in (("controller", _CONTROLLER), ("planner", _PLANNER), ("navigator", _NAVIGATOR)):
        if code in codes:
            return f" ({who}: {codes[code]})"
    return ""
