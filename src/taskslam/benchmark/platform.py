"""`Platform`: the robot, real or simulated. Navigation and protocol never know which."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from taskslam.geometry import SE2
from taskslam.measurements import Measurement


class Platform(Protocol):
    """What the closed loop needs of a robot. Times are integer nanoseconds."""

    @property
    def now(self) -> int:
        """The platform's time."""

    def reset(self, pose: SE2) -> None:
        """Put the robot at `pose` in `map`, at rest, odometry zeroed."""

    def advance(self, until: int) -> Iterator[Measurement]:
        """Let time run to `until`, yielding measurements in stamp order."""

    def drive(self, linear: float, angular: float) -> None:
        """Command body velocities, m/s and rad/s."""

    def true_pose(self) -> SE2 | None:
        """The true pose in `map`, where it is known; only the record may ask."""

    def bumped(self) -> bool:
        """Whether the bumper was pressed since the last call."""
