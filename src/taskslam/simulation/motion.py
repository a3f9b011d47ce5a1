"""`Motion`: where the base has been of late, so that a sensor can look at any instant and not only at physics steps."""

from __future__ import annotations

from copy import copy
from typing import Self

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import SE2, FloatArray

_KEEP = 128  # steps; longer than any sensor's sweep


class Motion:
    """The last physics steps: at each end the stamp, the true pose in `map`, and the body velocities.

    Within a step the base moves on a circular arc at the step's mean velocity.
    """

    def __init__(self, stamp: int, pose: SE2) -> None:
        self._stamps = np.full(_KEEP, stamp, np.int64)
        self._states = np.zeros((_KEEP, 5))  # x, y, theta, linear, angular
        self._states[:] = (pose.x, pose.y, pose.theta, 0.0, 0.0)
        self._newest = 0
        self._late = 0

    def late(self, by: int) -> Self:
        """The same as a clock that is `by` ns ahead tells it: at a stamp, what was so much earlier. For use at once."""
        told = copy(self)
        told._late = by
        return told

    def push(self, stamp: int, x: float, y: float, theta: float, linear: float, angular: float) -> None:
        """Append the end of a step; theta is not wrapped."""
        self._newest = (self._newest + 1) % _KEEP
        self._stamps[self._newest] = stamp
        self._states[self._newest] = (x, y, theta, linear, angular)

    def pose_at(self, stamps: npt.ArrayLike) -> FloatArray:
        """(N, 3) true poses x, y, theta in `map` at (N,) stamps (ns), held beyond both ends of what is remembered."""
        poses: FloatArray = self.states_at(stamps)[:, :3]
        return poses

    def states_at(self, stamps: npt.ArrayLike) -> FloatArray:
        """(N, 5) the same with body velocities, m/s and rad/s, which are linear between step ends."""
        asked = np.asarray(stamps, np.int64) - self._late
        states: FloatArray = _interpolate(self._stamps, self._states, self._newest, asked)
        return states


@njit(cache=True)
def _interpolate(stamps, states, newest, asked):  # type: ignore[no-untyped-def]
    """(N, 5) states at `asked` from a ring whose newest entry stands at `newest`."""
    out = np.empty((len(asked), 5))
    size = len(stamps)
    for i in range(len(asked)):
        after, back = newest, 0
        while back < size - 1 and stamps[(after - 1) % size] >= asked[i]:
            after = (after - 1) % size
            back += 1
        before = after if back == size - 1 else (after - 1) % size
        a, b = states[before], states[after]
        span = stamps[after] - stamps[before]
        share = 1.0 if span == 0 else min(max((asked[i] - stamps[before]) / span, 0.0), 1.0)
        out[i] = a + share * (b - a) if share < 1.0 else b
        # A chord would cut the corner: the arc lies beside it, to the right of the motion where the base turns left.
        bulge = 0.5 * (b[2] - a[2]) * share * (1.0 - share)
        out[i, 0] += bulge * (b[1] - a[1])
        out[i, 1] -= bulge * (b[0] - a[0])
    return out
