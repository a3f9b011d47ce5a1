"""`Vigil`: when a tracker that measures nothing becomes lost, and when it gives up the map that it had.

What does not fit is no measurement: the camera is taken to go on as it did for `lost_after` seconds, and is lost then,
standing, until a pair fits again. After `reinit_after` seconds the map is given up.
"""

from __future__ import annotations

from taskslam.measurements import NANOSECONDS
from taskslam.slam.base import Status


class Vigil:
    """lost_after, reinit_after: seconds without a fit. A tracker that never began is lost after the latter."""

    def __init__(self, lost_after: float, reinit_after: float) -> None:
        self._lost_after, self._reinit_after = lost_after * NANOSECONDS, reinit_after * NANOSECONDS
        self._since: int | None = None
        self._began = False

    def fits(self, stamp: int) -> None:
        """The pair of this stamp, ns, was tracked, or began a map."""
        self._since, self._began = stamp, True

    def misses(self, stamp: int) -> Status:
        """The pair of this stamp, ns, was not: what is to be said of the pose."""
        patience = self._lost_after if self._began else self._reinit_after
        if self._missing(stamp) >= patience:
            return Status.LOST
        return Status.TRACKING if self._began else Status.STARTING

    def gives_up(self, stamp: int) -> bool:
        """Whether a map that was not found for so long is worth nothing any more."""
        return self._missing(stamp) > self._reinit_after

    def _missing(self, stamp: int) -> int:
        if self._since is None:
            self._since = stamp
        return stamp - self._since
