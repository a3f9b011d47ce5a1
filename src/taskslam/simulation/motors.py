"""What the wheels make of a command: they follow it with a lag, and one that is told to crawl stands."""

from __future__ import annotations

import math

from taskslam.robot.imperfections import MotorImperfections


class Motors:
    """Two wheels of a differential drive."""

    def __init__(self, wrong: MotorImperfections | None) -> None:
        self._wrong = wrong
        self.reset()

    def reset(self) -> None:
        """At rest."""
        self._linear = self._angular = 0.0

    def driven(self, linear: float, angular: float, dt: float) -> tuple[float, float]:
        """Body velocities (m/s, rad/s) for which the wheels strive dt seconds on, of those commanded."""
        if self._wrong is None:
            return linear, angular
        share = 1.0 - math.exp(-dt / self._wrong.lag) if self._wrong.lag else 1.0
        self._linear += share * (linear - self._linear)
        self._angular += share * (angular - self._angular)
        half = 0.5 * self._wrong.track * self._angular
        left, right = (
            0.0 if abs(wheel) < self._wrong.deadband else wheel for wheel in (self._linear - half, self._linear + half)
        )
        return 0.5 * (left + right), (right - left) / self._wrong.track
