"""`Platform`: the robot, real or simulated, with a life of its own. Navigation and protocol never know which.

with platform:  # open; on the way out, whatever happened, halt and close
    platform.place(start)
    for measurement in platform.advance(until):
        ...
    platform.drive(0.2, 0.0)
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from types import TracebackType
from typing import Protocol, Self

from taskslam.geometry import SE2
from taskslam.measurements import Measurement
from taskslam.record.manifest import DrivenBy


class Platform(Protocol):
    """What the protocol needs of a robot. Times are integer nanoseconds since `zero_utc`.

    driven_by: for run.json, what drove. resumable: whether `go_on` continues an interrupted run as if nothing had been.
    returns: between rounds without map the robot shall drive to the start by itself; `returned` then says that it has.
    """

    driven_by: DrivenBy
    resumable: bool = False
    returns: bool = False

    @property
    def zero_utc(self) -> datetime:
        """What t = 0 was, in UTC; known once the platform is open."""

    @property
    def now(self) -> int:
        """The platform's time."""

    def open(self) -> None:
        """Get ready: connect, start sensors. Raises InfrastructureError."""

    def go_on(self, now: int, placed: int, zero_utc: datetime) -> None:
        """Be as after so many calls of `place` at time `now`; asked before the next of them, where `resumable`."""

    def place(self, pose: SE2) -> str:
        """Begin at `pose` in `map`, at rest, odometry zeroed: put the robot there, or wait until it stands there.

        What the record should know of how it came there, in a sentence; empty where that is nothing.
        """

    def returned(self) -> None:
        """The robot has driven to the start by itself: the next `place` leaves it where it stands."""
        raise AssertionError(f"{type(self).__name__} does not drive to the start by itself")

    def advance(self, until: int) -> Iterator[Measurement]:
        """Let time run to `until`, yielding measurements in stamp order."""

    def drive(self, linear: float, angular: float) -> None:
        """Command body velocities, m/s and rad/s."""

    def halt(self) -> None:
        """Zero speed at once, whatever happened before; also while nothing else answers."""

    def true_pose(self) -> SE2 | None:
        """The true pose in `map`, where it is known; only the record may ask."""

    def bumped(self) -> bool:
        """Whether the bumper was pressed since the last call."""

    def close(self) -> None:
        """Let go of everything; the robot stands. May be called more than once."""

    def __enter__(self) -> Self:
        try:
            self.open()
        except BaseException:
            self.close()  # what was half open
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        try:
            self.halt()
        finally:
            self.close()
