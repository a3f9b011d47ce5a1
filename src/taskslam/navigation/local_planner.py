"""The seam between the navigator and whatever follows the global path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from taskslam.geometry import SE2, FloatArray
from taskslam.navigation.costmap import LocalCostmap
from taskslam.navigation.velocity_smoother import Velocity


@dataclass(frozen=True)
class ControlRequest:
    """All that a local planner may know. Poses and points are in `odom`; now: simulated ns.

    path: (N, 2) the newest global plan from where the robot was then to the goal; velocity: from odometry.
    """

    now: int
    pose: SE2
    velocity: Velocity
    path: FloatArray
    goal: SE2
    costmap: LocalCostmap


@runtime_checkable
class LocalPlanner(Protocol):
    """Turns a global plan into velocity commands. Must be deterministic, read no clock and change nothing it is given.

    Others add one by an entry point of the group `taskslam.planners` (`planners.py`): a callable that takes the
    `Robot`. It is asked at 5 Hz; whether the goal is reached is not for it to say. The base is spared accelerations and
    speeds that it has not (`VelocitySmoother`).
    """

    def reset(self) -> None:
        """Forget everything: a new goal far away, or a new round."""

    def command(self, request: ControlRequest) -> Velocity | None:
        """The velocity to drive with until the next call, or None when there is no admissible one."""
