"""How a differential drive follows a velocity command: limited acceleration, then an exact arc per step."""

from __future__ import annotations

import math

from taskslam.compiled import njit


@njit(cache=True)
def ramp(value: float, target: float, limit: float) -> float:
    """`value` moved towards `target` by at most `limit`."""
    step = target - value
    if step > limit:
        return value + limit
    if step < -limit:
        return value - limit
    return target


@njit(cache=True)
def step_arc(x: float, y: float, theta: float, linear: float, angular: float, dt: float) -> tuple[float, float, float]:
    """Pose after dt seconds at constant body velocities: the exact circular arc (m, rad; m/s, rad/s).

    The midpoint chord with its sinc factor, which is exact and has no special case at angular = 0.
    """
    half = 0.5 * angular * dt
    sinc = 1.0 - half * half / 6.0 if abs(half) < 1e-4 else math.sin(half) / half
    chord = linear * dt * sinc
    return x + chord * math.cos(theta + half), y + chord * math.sin(theta + half), theta + angular * dt
