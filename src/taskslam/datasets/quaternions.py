"""Unit quaternions x y z w, as messages and tables write them, to and from poses; headings survive bit for bit."""

from __future__ import annotations

import math

import numpy as np

from taskslam.geometry import SE2, FloatArray
from taskslam.record.trajectories import UNIT_TOLERANCE

_NUDGES = 16


def planar_quaternion(theta: float) -> tuple[float, float]:
    """(z, w) of a heading in [-pi, pi], such that `heading` gives it back bit for bit.

    sin and cos of the half angle, the sine moved by a few units in its last place where rounding would lose the last
    bit: a recording must not differ from what was recorded.
    """
    z, w = math.sin(0.5 * theta), math.cos(0.5 * theta)
    up = down = z
    for _ in range(_NUDGES):
        for candidate in (up, down):
            if heading(candidate, w) == theta:
                return candidate, w
        up, down = math.nextafter(up, math.inf), math.nextafter(down, -math.inf)
    return z, w


def heading(z: float, w: float) -> float:
    """Heading in [-pi, pi] of the quaternion (0, 0, z, w)."""
    half = math.atan2(z, w)
    if half > 0.5 * math.pi:
        half -= math.pi
    elif half < -0.5 * math.pi:
        half += math.pi
    return 2.0 * half


def pose_of(xyz: tuple[float, float, float], quaternion: tuple[float, float, float, float]) -> FloatArray | None:
    """(4, 4) pose, or None if the numbers are not finite or the quaternion is not of unit length within 1e-2."""
    x, y, z, w = quaternion
    norm = math.hypot(x, y, z, w)
    if not all(map(math.isfinite, (*xyz, norm))) or abs(norm - 1.0) > UNIT_TOLERANCE:
        return None
    if x == 0.0 and y == 0.0:
        T = SE2(xyz[0], xyz[1], heading(z, w)).matrix()
        T[2, 3] = xyz[2]
        return T
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), xyz[0]],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), xyz[1]],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), xyz[2]],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
