"""A logarithmic axis with round ticks: errors of good and bad methods lie two powers of ten apart."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from taskslam.geometry import FloatArray

CENTIMETRE = 0.01  # m
FLOOR = 1e-4  # m, rad or ms; smaller errors are drawn here
_ROUND = (1.0, 2.0, 5.0)


@dataclass(frozen=True)
class LogAxis:
    """From low to high, both in metres, or both in radians or milliseconds."""

    low: float
    high: float

    def share(self, value: float) -> float:
        """Where a value lies on the axis, 0 at its low end and 1 at its high end; held inside."""
        inside = min(max(value, self.low), self.high)
        return math.log(inside / self.low) / math.log(self.high / self.low)

    def ticks(self, unit: float, most: int = 8) -> list[float]:
        """Round multiples of a unit on the axis, as numbers of units: 1, 2, 5, 10, ... or 1, 10, 100.

        unit: in metres or radians. most: with more than so many, only the powers of ten are kept.
        """
        low, high = self.low / unit, self.high / unit
        found = [value for value in _round_numbers(low, high) if low * (1 - 1e-9) <= value <= high * (1 + 1e-9)]
        if len(found) <= most:
            return found
        return [value for value in found if abs(math.log10(value) - round(math.log10(value))) < 1e-9]


def log_axis(values: Iterable[float] | FloatArray, unit: float = CENTIMETRE) -> LogAxis:
    """The axis between round numbers of units that holds all values and spans at least a power of ten.

    values, unit: in metres, or both in what they are measured in.
    """
    held = [max(float(value), FLOOR) for value in values]
    if not held:
        return LogAxis(unit, 10 * unit)
    candidates = _round_numbers(min(held) / unit / 20, max(held) / unit * 20)
    low = max(value for value in candidates if value <= min(held) / unit * (1 + 1e-9))
    high = min(value for value in candidates if value >= max(max(held) / unit * 1.02, low * 10) * (1 - 1e-9))
    return LogAxis(low * unit, high * unit)


def _round_numbers(low: float, high: float) -> list[float]:
    """1, 2 and 5 times powers of ten that surely cover low to high."""
    powers = range(math.floor(math.log10(low)) - 1, math.ceil(math.log10(high)) + 2)
    return [float(f"{digit:g}e{power}") for power in powers for digit in _ROUND]
