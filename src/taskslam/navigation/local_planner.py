"""The seam between the navigator and whatever follows the global path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

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


class LocalPlanner(Protocol):
    """Turns a global plan into velocity commands. Must be deterministic and must not read a clock."""

    def reset(self) -> None:
        """Forget everything: a new goal far away, or a new round."""

    def command(self, request: ControlRequest) -> Velocity | None:
        """The velocity to drive with until the next call, or None when there is no admissible one."""
