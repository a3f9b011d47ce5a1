"""Whether a method's poses can be true of a robot whose wheels roll: jumps, and speeds that odometry contradicts.

Nothing is repaired: the robot drives by what the method says, and the record says when that was hard to believe.
"""

from __future__ import annotations

import math
from collections import deque

from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS

JUMP_M, JUMP_RAD = 0.5, 0.5  # between one estimate and the next, beyond what the wheels say
SPEED, TURN_RATE = 0.3, 0.3  # m/s, rad/s against odometry: as fast as the planner ever drives; slip is far below it
_OVER_S = (0.5, 1.0)  # a speed is taken over at least, and at most, this long: noise of single poses is no speed


class Plausibility:
    """Compares each estimate with the odometry since the ones before it. One watch for each reset."""

    def __init__(self) -> None:
        self._before: deque[tuple[int, SE2]] = deque()  # stamp, and T_map_odom as corrected by it

    def doubt(self, stamp: int, T_map_odom: SE2, T_odom_base: SE2) -> str | None:
        """What is wrong with the estimate about time `stamp` (ns), in words, or None.

        T_map_odom: the correction that the estimate asks for; T_odom_base: odometry at its stamp. After a doubt the
        watch begins anew, so that one jump is told once.
        """
        said = self._jump(T_map_odom, T_odom_base) or self._speed(stamp, T_map_odom, T_odom_base)
        if said:
            self._before.clear()
        self._before.append((stamp, T_map_odom))
        while stamp - self._before[0][0] > _OVER_S[1] * NANOSECONDS:
            self._before.popleft()
        return said

    def _jump(self, T_map_odom: SE2, T_odom_base: SE2) -> str | None:
        if not self._before:
            return None
        distance, turn = _apart(self._before[-1][1], T_map_odom, T_odom_base)
        if distance <= JUMP_M and turn <= JUMP_RAD:
            return None
        return f"jumped by {distance:.2f} m, {turn:.2f} rad"

    def _speed(self, stamp: int, T_map_odom: SE2, T_odom_base: SE2) -> str | None:
        if not self._before or stamp - self._before[0][0] < _OVER_S[0] * NANOSECONDS:
            return None
        seconds = (stamp - self._before[0][0]) / NANOSECONDS
        distance, turn = _apart(self._before[0][1], T_map_odom, T_odom_base)
        if distance <= SPEED * seconds and turn <= TURN_RATE * seconds:
            return None
        return f"moves at {distance / seconds:.2f} m/s, {turn / seconds:.2f} rad/s against odometry"


def _apart(one: SE2, two: SE2, T_odom_base: SE2) -> tuple[float, float]:
    """How far two corrections put the robot apart: m and rad, at the robot and not at odometry's origin."""
    moved = (one @ T_odom_base).inverse() @ (two @ T_odom_base)
    return math.hypot(moved.x, moved.y), abs(moved.theta)
