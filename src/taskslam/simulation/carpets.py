"""Carpets under the wheels: these count more way there, and the pile pushes the robot aside.

Neither wheels nor gyro know of that push. Carpets lie in `map`, where a run's seed puts them, and are no obstacles.
"""

from __future__ import annotations

import math
from functools import cache

from taskslam.robot.imperfections import CarpetImperfections
from taskslam.simulation.streams import stream


class Carpets:
    """Where they lie, and what they do."""

    def __init__(self, wrong: CarpetImperfections | None, seed: int) -> None:
        self._wrong = wrong
        self._seed = seed
        self._pile = cache(self._drawn)

    def driven_over(self, distance: float, x: float, y: float) -> tuple[float, float, float]:
        """What the wheels count of `distance` that ends at (x, y) in `map`, and where it truly ends; all in m."""
        pile = self._pile(math.floor(x / self._wrong.size), math.floor(y / self._wrong.size)) if self._wrong else None
        if self._wrong is None or pile is None:
            return distance, x, y
        push = self._wrong.drift * abs(distance)
        return distance * (1.0 + self._wrong.scale), x + push * math.cos(pile), y + push * math.sin(pile)

    def _drawn(self, column: int, row: int) -> float | None:
        """The direction of the pile in a cell, rad; None where the floor is bare."""
        assert self._wrong is not None
        dice = stream(self._seed, f"carpets/{column},{row}")
        return float(dice.uniform(-math.pi, math.pi)) if dice.random() < self._wrong.share else None
