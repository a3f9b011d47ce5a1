"""Which local planners exist: entry points of the group `taskslam.planners`, from this package or anyone else's.

Each is a callable `(robot: Robot) -> LocalPlanner`. A planner from outside drives in the benchmark's own process, so
what it raises, and a command that is none, ends the run with a sentence that names it.
"""

from __future__ import annotations

import math
from importlib.metadata import EntryPoint

from taskslam.errors import PlannerError, did_you_mean
from taskslam.measurements import NANOSECONDS
from taskslam.navigation.local_planner import ControlRequest, LocalPlanner
from taskslam.navigation.velocity_smoother import Velocity
from taskslam.plugins import registered
from taskslam.robot.robot import Robot

PLANNER_GROUP = "taskslam.planners"


def registered_planners() -> dict[str, EntryPoint]:
    """All local planners by name. Nothing is imported."""
    return registered(PLANNER_GROUP)


def find_planner(name: str) -> EntryPoint:
    """The entry point of a registered name. Raises PlannerError listing the known ones."""
    known = registered_planners()
    if name not in known:
        listed = ", ".join(known) or "none"
        raise PlannerError(f"no local planner is called '{name}' (known: {listed}).{did_you_mean(name, known)}")
    return known[name]


def build_planner(name: str, robot: Robot) -> LocalPlanner:
    """A new planner for this robot, watched: its `command` raises PlannerError where the planner breaks its contract.

    Raises:
        PlannerError: no such planner, or it cannot be imported or built, or lacks `reset` or `command`.
    """
    entry = find_planner(name)
    try:
        planner = entry.load()(robot)
    except Exception as error:
        raise PlannerError(f"planner '{name}' ({entry.value}) cannot be built: {_words(error)}") from error
    if not isinstance(planner, LocalPlanner):
        raise PlannerError(f"planner '{name}' ({entry.value}) has no `reset()` and `command(request)`")
    return _Watched(name, planner)


def planner_version(name: str) -> dict[str, str]:
    """Name and version of the installed package that registers a planner. Raises PlannerError."""
    package = find_planner(name).dist
    return {package.name: package.version} if package is not None else {}


class _Watched:
    """Says which planner failed, and when."""

    def __init__(self, name: str, planner: LocalPlanner) -> None:
        self._name = name
        self._planner = planner

    def reset(self) -> None:
        self._planner.reset()

    def command(self, request: ControlRequest) -> Velocity | None:
        where = f"planner '{self._name}' at {request.now / NANOSECONDS:.2f} s"
        try:
            command = self._planner.command(request)
        except Exception as error:
            raise PlannerError(f"{where}: {_words(error)}") from error
        if command is None:
            return None
        if not isinstance(command, Velocity) or not math.isfinite(command.linear) or not math.isfinite(command.angular):
            raise PlannerError(f"{where}: gave {command!r:.80}; expected a finite Velocity, or None")
        return command


def _words(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"[:300]
