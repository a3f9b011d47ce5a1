"""Axes of errors: in centimetres and degrees, and beside them in the task's own units (protocol 5.5).

The task's units are the robot's diameter D for positions and the camera's field of view FoV for headings. An axis is
logarithmic where its values range over more than a factor of eight, and starts at 0 where they do not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

from taskslam.report import palette
from taskslam.report.log_axis import log_axis

UnitSystem: TypeAlias = Literal["metric", "task"]
Direction: TypeAlias = Literal["x", "y"]

_LINEAR_RANGE = 8.0  # values within this factor share a linear axis
_FLOOR = 0.01  # cm or degrees: smaller values are drawn here on a logarithmic axis
_MOST_TICKS = 7


@dataclass(frozen=True)
class Measure:
    """What an axis measures, in `unit`: cm or degrees.

    factor: from metres or radians; task: name of the task's unit; size: how many `unit` it is, None where the
    scenarios of a figure differ; parts: into how many parts the task's unit is divided where a whole one is too large.
    """

    precision: str
    accuracy: str
    unit: str
    factor: float
    task: str
    size: float | None
    parts: tuple[int, ...]

    def shown(self, value: float) -> float:
        """Metres or radians as centimetres or degrees."""
        return value * self.factor

    @property
    def task_label(self) -> str:
        """The task's unit and its size, as at an axis."""
        return "" if self.size is None else f"{self.task} of {self.size:g} {self.unit}".replace(" °", "°")


def position(diameter_m: float | None) -> Measure:
    """Positions in centimetres and robot diameters D; protocol 5.5 marks every D, and sixths of it for EuRoC."""
    size = None if diameter_m is None else round(100 * diameter_m, 6)
    return Measure("E", "e", "cm", 100.0, "D", size, (1, 2, 3, 6, 12, 30, 60, 120, 300, 600))


def orientation(field_of_view: float | None) -> Measure:
    """Headings in degrees and fields of view; protocol 5.5 marks sixteenths, and single degrees for EuRoC."""
    return Measure("Δ", "δ", "°", math.degrees(1.0), "FoV", field_of_view, (1, 2, 4, 8, 16, 40, 80, 160, 400, 800))


@dataclass(frozen=True)
class Scale:
    """From low to high in the quantity's unit."""

    low: float
    high: float
    log: bool

    def held(self, value: float) -> float:
        """The value, or the end of the axis that it lies beyond."""
        return min(max(value, self.low), self.high)

    def ticks(self, quantity: Measure, units: UnitSystem, most: int = _MOST_TICKS) -> list[tuple[float, str]]:
        """Round numbers and where they stand; none for a task unit of unknown size."""
        size = 1.0 if units == "metric" else quantity.size
        if size is None:
            return []
        if self.log:
            numbers = _log_ticks(self.low / size, self.high / size, most)
            return [(number * size, f"{number:g}") for number in numbers]
        if units == "metric":
            step = _round_step(self.high / most)
            return [(index * step, f"{index * step:g}") for index in range(int(self.high / step + 1e-9) + 1)]
        fitting = [parts for parts in quantity.parts if self.high / size * parts <= most]
        parts = fitting[-1] if fitting else 1
        every = 1 if fitting else math.ceil(self.high / size / most)
        count = int(self.high / size * parts + 1e-9)
        return [(index * size / parts, _fraction(index, parts)) for index in range(0, count + 1, every)]


def scale_of(values: Sequence[float], least: float = 0.0, linear: bool = False) -> Scale:
    """The scale that shows all values, in their unit. least: reach at least this far; linear: from 0, always."""
    positive = [max(value, _FLOOR) for value in values]
    top = max([*positive, least]) if positive or least else 1.0
    if not linear and positive and top / min(positive) > _LINEAR_RANGE:
        # `log_axis` rounds metres to centimetres: a hundredth of our unit stands for its metre.
        axis = log_axis([*(value / 100 for value in positive), *([least / 100] if least else [])])
        return Scale(axis.low * 100, axis.high * 100, True)
    step = _round_step(1.06 * top / 5)
    return Scale(0.0, math.ceil(1.06 * top / step - 1e-9) * step, False)


def set_axis(axes: Axes, direction: Direction, scale: Scale, quantity: Measure, units: UnitSystem, what: str) -> None:
    """Give an axis its scale, ticks and label in the chosen units, and the other units on the opposite side.

    what: what the axis shows, such as `accuracy e`. Where the task's unit has no one size, metric units stand alone.
    """
    known = quantity.size is not None
    main: UnitSystem = units if known else "metric"
    if direction == "x":
        axes.set_xscale("log" if scale.log else "linear")
        axes.set_xlim(scale.low, scale.high)
        other = axes.secondary_xaxis("top") if known else None
    else:
        axes.set_yscale("log" if scale.log else "linear")
        axes.set_ylim(scale.low, scale.high)
        other = axes.secondary_yaxis("right") if known else None
    for held, shown, most in ((axes, main, 6), (other, _other(main), 4)):
        if held is None:
            continue
        axis = held.xaxis if direction == "x" else held.yaxis
        _set_ticks(axis, scale.ticks(quantity, shown, most))
        if held is axes:
            axis.set_label_text(f"{what} ({_unit_label(quantity, shown)})")
        elif direction == "x":  # said once: the axis on the right has the same unit
            axis.set_label_text(f"in {_unit_label(quantity, shown)}")


def add_grid(axes: Axes) -> None:
    """Hairlines at the ticks of both axes."""
    axes.grid(visible=True, which="major", color=palette.HAIRLINE, linewidth=0.5)


def add_parity(axes: Axes, scale: Scale, text: str) -> None:
    """The dashed line on which precision equals accuracy; below it a robot repeats better than it hits the goal."""
    axes.plot([scale.low, scale.high], [scale.low, scale.high], color=palette.FAILURE, linewidth=0.9, dashes=(4, 2.5))
    axes.annotate(
        text, (0.16, 0.16), (-2, 2), xycoords="axes fraction", textcoords="offset points", color=palette.FAILURE,
        rotation=45, rotation_mode="anchor", ha="center", va="bottom",
    )  # fmt: skip


def _set_ticks(axis: Axis, ticks: Sequence[tuple[float, str]]) -> None:
    axis.set_major_locator(FixedLocator([place for place, _ in ticks]))
    axis.set_major_formatter(FixedFormatter([text for _, text in ticks]))
    axis.set_minor_locator(NullLocator())


def _unit_label(quantity: Measure, units: UnitSystem) -> str:
    return quantity.unit if units == "metric" else quantity.task_label


def _other(units: UnitSystem) -> UnitSystem:
    return "task" if units == "metric" else "metric"


def _log_ticks(low: float, high: float, most: int) -> list[float]:
    """1, 2, 5 times powers of ten between low and high; with too many, 1 and 3, or powers of ten alone."""
    powers = range(math.floor(math.log10(low)) - 1, math.ceil(math.log10(high)) + 2)
    for digits in ((1, 2, 5), (1, 3), (1,)):
        found = [float(f"{digit}e{power}") for power in powers for digit in digits]
        found = [value for value in found if low * (1 - 1e-9) <= value <= high * (1 + 1e-9)]
        if len(found) <= most:
            return found
    return found


def _round_step(least: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is not below `least`."""
    power = math.floor(math.log10(least))
    return next(step for step in (float(f"{digit}e{power}") for digit in (1, 2, 5, 10)) if step >= least * (1 - 1e-9))


def _fraction(count: int, parts: int) -> str:
    return f"{count}" if parts == 1 or count == 0 else f"{count}/{parts}"
