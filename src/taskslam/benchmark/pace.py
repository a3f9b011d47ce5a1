"""`Pace`: when the next control period of a served robot may pass, on the wall's clock. Knows neither ROS nor robots.

In step with the other side (no factor): a period passes as soon as a command has come. One that is not there yet is
waited for: long while the robot is under way, since the other side may be slow, and shortly while it was told to stand,
since the other side may have nothing to say. Where one was waited for in vain, periods pass in real time until the next
command comes.

At a factor of real time: periods pass by the wall's clock, commands or not. A machine that is too slow for the factor
gives what it can, and does not hurry afterwards.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from enum import Enum

_STANDS_S = 1.0  # so long a command is waited for while the robot was told to stand
_LAG_S = 0.2  # behind by more than that, a rate begins anew


class _Other(Enum):
    """What the other side was last known to do."""

    DRIVES = "drives"
    STANDS = "stands"
    SILENT = "silent"


class Pace:
    """period_s: of control, simulated; factor: times real time, None for in step; patience_s: for a side that drives.

    vain: how often a command was waited for in vain while the robot was under way; wall: s, a monotonic clock.
    """

    def __init__(
        self, period_s: float, factor: float | None, patience_s: float, wall: Callable[[], float] = time.monotonic
    ) -> None:
        self._period_s, self._factor, self._patience_s, self._wall = period_s, factor, patience_s, wall
        self._other = _Other.SILENT
        self._answered = False
        self._since = self._due = wall()
        self.vain = 0

    def passed(self) -> bool:
        """A period has passed. Whether the command before it was waited for in vain, the robot being under way."""
        vain = self._factor is None and not self._answered and self._other is _Other.DRIVES
        if not self._answered:
            self._other = _Other.SILENT
        self.vain += vain
        now = self._since = self._wall()
        self._answered = False
        step = self._period_s / (self._factor or 1.0)
        self._due = self._due + step if now - self._due <= max(step, _LAG_S) else now + step
        return vain

    def commanded(self, moving: bool) -> None:
        """A command has come. moving: it is not to stand."""
        self._answered = True
        self._other = _Other.DRIVES if moving else _Other.STANDS

    def placed(self) -> None:
        """The robot was put down for somebody, who is about to drive."""
        self._answered = False
        self._other, self._since = _Other.DRIVES, self._wall()

    def alone(self) -> None:
        """Nobody is there to command."""
        self._other = _Other.SILENT

    def left_s(self) -> float:
        """How long until the next period may pass even if nothing comes; 0 where it may now."""
        now = self._wall()
        if self._factor is not None or self._other is _Other.SILENT:
            due = self._due
        elif self._answered:
            return 0.0
        else:
            due = self._since + (self._patience_s if self._other is _Other.DRIVES else _STANDS_S)
        return max(0.0, due - now)
