"""`Pace`: when the next control period of a served robot may pass, on the wall's clock. Knows neither ROS nor robots.

In step with the other side (no factor): how many periods lie between its commands is learned from the last of them.
Periods pass at once until the next command is due; then it is waited for: long while the robot is under way, since the
other side may be slow, and shortly while it was told to stand, since the other side may have nothing to say. Where one
was waited for in vain, where none ever came, or where they come too rarely for a controller, periods pass in real time.

At a factor of real time: periods pass by the wall's clock, commands or not. A machine that is too slow for the factor
gives what it can, and does not hurry afterwards.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from enum import Enum

_STARTS_S = 120.0  # so long whoever had the robot put down may take to get ready, a SLAM method with its vocabulary
_STANDS_S = 1.0  # so long a command is waited for while the robot was told to stand
_LAG_S = 0.2  # behind by more than that, a rate begins anew
_LEARNED = 2  # intervals that tell how often commands come
_REMEMBERED = 5
_RAREST_S = 0.5  # simulated, between the commands of a controller


class _Other(Enum):
    """What the other side was last known to do."""

    STARTS = "starts"
    DRIVES = "drives"
    STANDS = "stands"
    SILENT = "silent"


class Pace:
    """period_s: of control, simulated; factor: times real time, None for in step; patience_s: for a side that drives.

    vain: how often a command was waited for in vain while it was not told to stand; wall: s, a monotonic clock.
    """

    def __init__(
        self, period_s: float, factor: float | None, patience_s: float, wall: Callable[[], float] = time.monotonic
    ) -> None:
        self._period_s, self._factor, self._patience_s, self._wall = period_s, factor, patience_s, wall
        self._other = _Other.SILENT
        self._answered = False
        self._intervals: deque[int] = deque(maxlen=_REMEMBERED)  # in periods, from one command to the next
        self._periods = 0  # since the last command
        self._since = self._due = wall()
        self.vain = 0

    def passed(self) -> bool:
        """A period has passed. Whether the command before it was waited for in vain, the robot not told to stand."""
        vain = False
        if self._is_awaited and not self._answered:
            vain = self._other is not _Other.STANDS
            self._other = _Other.SILENT
        self.vain += vain
        self._periods += 1
        now = self._since = self._wall()
        self._answered = False
        step = self._period_s / (self._factor or 1.0)
        on_time = 0 <= now - self._due <= max(step, _LAG_S)
        self._due = (self._due if on_time else now) + step
        return vain

    def commanded(self, moving: bool) -> None:
        """A command has come. moving: it is not to stand."""
        if self._other is not _Other.SILENT and self._periods:
            self._intervals.append(self._periods)
        self._answered, self._periods = True, 0
        self._other = _Other.DRIVES if moving else _Other.STANDS

    def placed(self) -> None:
        """The robot was put down for somebody, who is about to drive, and to command in every period."""
        self._answered, self._periods = False, 1
        self._intervals.extend([1] * _REMEMBERED)
        self._other, self._since = _Other.STARTS, self._wall()

    def alone(self) -> None:
        """Nobody is there to command."""
        self._other = _Other.SILENT

    def left_s(self) -> float:
        """How long until the next period may pass even if nothing comes; 0 where it may now."""
        if self._factor is not None or not self._is_in_step:
            due = self._due
        elif self._answered or not self._is_awaited:
            return 0.0
        else:
            waits = {_Other.STARTS: _STARTS_S, _Other.DRIVES: self._patience_s, _Other.STANDS: _STANDS_S}
            due = self._since + waits[self._other]
        return max(0.0, due - self._wall())

    @property
    def _is_in_step(self) -> bool:
        """Whether there is a side whose commands tell how time goes on."""
        known = len(self._intervals) >= _LEARNED and max(self._intervals) * self._period_s <= _RAREST_S
        return self._factor is None and self._other is not _Other.SILENT and known

    @property
    def _is_awaited(self) -> bool:
        """Whether the next command is due."""
        return self._is_in_step and self._periods >= max(self._intervals)
