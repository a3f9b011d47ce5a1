"""Waiting for somebody else no longer than a limit, on the wall's clock, without the time in which we stood still."""

from __future__ import annotations

import time
from collections.abc import Callable

_LONGEST_LOOK_S = 1.0


class Patience:
    """A limit of so many seconds that counts down from look to look. waited: s so far.

    longest_look_s: a look that comes later than that after the last one found us stopped in between (a job that is
    suspended, a machine without time for us), and most likely what is waited for as well: it counts as so much.
    """

    def __init__(
        self, limit_s: float, longest_look_s: float = _LONGEST_LOOK_S, wall: Callable[[], float] = time.monotonic
    ) -> None:
        self.limit_s, self.waited = limit_s, 0.0
        self._longest_look_s, self._wall = longest_look_s, wall
        self._looked = wall()

    def look(self) -> float:
        """What is left, s; 0 once it is over."""
        now = self._wall()
        self.waited += min(now - self._looked, self._longest_look_s)
        self._looked = now
        return max(0.0, self.limit_s - self.waited)
