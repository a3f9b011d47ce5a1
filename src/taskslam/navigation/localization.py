"""`Localization`: keeps `T_map_odom`, the one number through which a SLAM method steers the robot.

    T_map_odom = T_map_start @ T_start_base(t) @ inverse(T_odom_base(t))                       (protocol 2.2, design D5)

t is the stamp of the estimate itself, so an estimate that arrives late corrects the pose that it is about, and the
odometry driven since then rides on top.
"""

from __future__ import annotations

from bisect import bisect_left
from enum import StrEnum

from taskslam.geometry import SE2, wrap_angle
from taskslam.measurements import NANOSECONDS


class Correction(StrEnum):
    """What became of an estimate. Only `APPLIED` changed `T_map_odom`."""

    APPLIED = "applied"
    TOO_OLD = "too_old"
    AHEAD_OF_ODOMETRY = "ahead_of_odometry"
    NOT_FINITE = "not_finite"


class Localization:
    """Where the robot is, from the latest estimate and the odometry around it.

    Until the first estimate the robot is where its odometry says, with odometry starting at `T_map_start`.
    """

    # map_to_odom_publisher waits this long for odometry, then drops the estimate (protocol 2.2)
    MAX_EXTRAPOLATION_S = 0.1

    def __init__(self, T_map_start: SE2, history_s: float = 10.0) -> None:
        self._T_map_start = T_map_start
        self._history = round(history_s * NANOSECONDS)
        self._stamps: list[int] = []
        self._poses: list[SE2] = []
        self.T_map_odom = T_map_start

    @property
    def T_odom_base(self) -> SE2:  # noqa: N802
        """The newest odometry; identity before the first."""
        return self._poses[-1] if self._poses else SE2()

    def T_map_base(self) -> SE2:  # noqa: N802
        """The robot's SLAM-based pose now: the latest correction, carried on by odometry."""
        return self.T_map_odom @ self.T_odom_base

    def odometry(self, stamp: int, T_odom_base: SE2) -> None:
        """Remember an odometry pose (ns). One that is not newer than the newest is dropped."""
        if self._stamps and stamp <= self._stamps[-1]:
            return
        self._stamps.append(stamp)
        self._poses.append(T_odom_base)
        if stamp - self._stamps[0] > 2 * self._history:
            first = max(bisect_left(self._stamps, stamp - self._history) - 1, 0)
            del self._stamps[:first], self._poses[:first]

    def correct(self, stamp: int, T_start_base: SE2) -> Correction:
        """Apply the estimate about time `stamp` (ns), or say why it cannot be applied."""
        if not T_start_base.is_finite():
            return Correction.NOT_FINITE
        T_odom_base = self.T_odom_base_at(stamp)
        if T_odom_base is None:
            newest = self._stamps[-1] if self._stamps else 0
            return Correction.AHEAD_OF_ODOMETRY if stamp > newest else Correction.TOO_OLD
        self.T_map_odom = self._T_map_start @ T_start_base @ T_odom_base.inverse()
        return Correction.APPLIED

    def T_odom_base_at(self, stamp: int) -> SE2 | None:  # noqa: N802
        """Odometry at a stamp: interpolated, or extrapolated by up to 0.1 s; None beyond the history."""
        stamps, poses = self._stamps, self._poses
        if not stamps:
            return SE2() if stamp == 0 else None
        if stamp < max(stamps[0], stamps[-1] - self._history):
            return None
        if stamp - stamps[-1] > self.MAX_EXTRAPOLATION_S * NANOSECONDS:
            return None
        after = min(bisect_left(stamps, stamp), len(stamps) - 1)
        if stamps[after] == stamp or len(stamps) == 1:
            return poses[after]
        before = after - 1
        share = (stamp - stamps[before]) / (stamps[after] - stamps[before])
        return _between(poses[before], poses[after], share)


def _between(a: SE2, b: SE2, share: float) -> SE2:
    """The pose at `share` of the way from a to b; beyond 1 it goes on along the chord."""
    return SE2(
        a.x + share * (b.x - a.x),
        a.y + share * (b.y - a.y),
        wrap_angle(a.theta + share * wrap_angle(b.theta - a.theta)),
    )
