"""When to give a goal up: the patience of move_base with recovery behaviours off (protocol 3.2)."""

from __future__ import annotations

from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS
from taskslam.navigation.settings import GoalSettings
from taskslam.outcomes import Outcome


class Patience:
    """Remembers when one goal last made progress of each kind. All times are simulated ns."""

    def __init__(self, settings: GoalSettings, now: int) -> None:
        self._settings = settings
        self._last_plan = now
        self._last_control = now
        self._last_moved = now
        self._moved_from: SE2 | None = None
        self._started = now
        self._deadline: int | None = None

    def allow_time(self, now: int, path_length: float, speed: float) -> None:
        """Set the time limit from the first plan's length (m) at full speed (m/s)."""
        s = self._settings
        self._deadline = now + round((s.timeout_base + s.timeout_factor * path_length / speed) * NANOSECONDS)

    def planned(self, now: int) -> None:
        """There is a plan, or a new one is wanted from now on."""
        self._last_plan = now

    def controlled(self, now: int) -> None:
        """There was a valid command."""
        self._last_control = now

    def moved(self, pose: SE2, now: int) -> None:
        """Tell where the robot is (SLAM-based pose in `map`)."""
        if self._moved_from is None or pose.distance_to(self._moved_from) >= self._settings.oscillation_distance:
            self._moved_from = pose
            self._last_moved = now

    def exhausted(self, now: int, planning: bool, where: str) -> tuple[Outcome | None, str]:
        """The first broken rule and a sentence, or (None, ""). planning: standing still, waiting for a plan."""
        s = self._settings
        if planning and _seconds(now - self._last_plan) > s.planner_patience:
            return Outcome.NO_PLAN, f"No path to the goal for {s.planner_patience:g} s {where}."
        if not planning and _seconds(now - self._last_control) > s.controller_patience:
            return Outcome.NO_CONTROL, f"No admissible velocity command for {s.controller_patience:g} s {where}."
        if not planning and _seconds(now - self._last_moved) > s.oscillation_timeout:
            return (
                Outcome.OSCILLATION,
                f"Moved less than {s.oscillation_distance:g} m in {s.oscillation_timeout:g} s {where}.",
            )
        if self._deadline is not None and now > self._deadline:
            return Outcome.GOAL_TIMEOUT, f"Not there after {_seconds(now - self._started):.0f} s {where}."
        return None, ""


def _seconds(ns: int) -> float:
    return ns / NANOSECONDS
