"""The simulator as a platform: time is simulated, and `zero_utc` is when it was opened."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime

from taskslam.benchmark.platform import Platform
from taskslam.errors import SimulatorFailedError
from taskslam.geometry import SE2
from taskslam.measurements import Measurement
from taskslam.record.manifest import DrivenBy
from taskslam.simulation.simulator import Simulator


class SimulatedPlatform(Platform):
    """A simulator, built when it is opened. No clock is read but once, to say in the record what t = 0 was.

    build: raises as `open` then does.
    """

    driven_by = DrivenBy.SIMULATOR
    resumable = True

    def __init__(self, build: Callable[[], Simulator]) -> None:
        self._build = build
        self._built: Simulator | None = None
        self._opened = datetime.now(UTC)

    @property
    def _simulator(self) -> Simulator:
        if self._built is None:
            raise SimulatorFailedError("the simulator was not opened")
        return self._built

    @property
    def zero_utc(self) -> datetime:
        """When it was opened."""
        return self._opened

    @property
    def now(self) -> int:
        """Simulated time, ns."""
        return self._simulator.now

    def open(self) -> None:
        """Build the simulator, and remember what t = 0 is."""
        self._built = self._build()
        self._opened = datetime.now(UTC)

    def go_on(self, now: int, placed: int, zero_utc: datetime) -> None:
        """Continue an interrupted run: noise depends on how often the robot was put down, and on nothing before."""
        self._simulator.go_on(now, placed)
        self._opened = zero_utc

    def place(self, pose: SE2) -> str:
        """Put the robot down at `pose`; time goes on."""
        self._simulator.reset(pose)
        return ""

    def advance(self, until: int) -> Iterator[Measurement]:
        """Run to `until` (ns), yielding measurements in stamp order."""
        return self._simulator.advance(until)

    def drive(self, linear: float, angular: float) -> None:
        """Command body velocities; they lapse after the drive's command timeout."""
        self._simulator.drive(linear, angular)

    def halt(self) -> None:
        """Command zero speed."""
        self._simulator.drive(0.0, 0.0)

    def true_pose(self) -> SE2:
        """The true pose in `map`."""
        return self._simulator.true_pose()

    def bumped(self) -> bool:
        """Whether the robot touched anything since the last call."""
        return self._simulator.bumped()

    def close(self) -> None:
        """Nothing is held but memory."""
