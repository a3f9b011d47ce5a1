"""Precision against accuracy, position and orientation, with the completeness beside them (protocol 5.3, 5.5).

A method is one marker at its means over complete waypoints: filled if and only if it reached every waypoint in every
round. Below the dashed line its arrivals agree better with one another than with the goal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from taskslam.report.figures.bars import KeyLine, Row
from taskslam.report.figures.panels import Legend, figure_with_panels
from taskslam.report.figures.scales import Measure, Scale, UnitSystem, add_grid, add_parity, scale_of, set_axis
from taskslam.report.figures.style import Width, marker_style, printed, say_empty
from taskslam.report.figures.tags import add_tags
from taskslam.report.markers import Style

_NUMBERED_ABOVE = 6  # methods; more than these are numbered, for colours alone would not tell them apart
_SIDES = (0.5, 0.3)  # in: left and right of a panel, for its ticks and labels
_FARTHEST = 4.0  # times its value: where a whisker no longer widens the axis, but runs into its end


@dataclass(frozen=True)
class Point:
    """One marker, in the quantity's unit. tag: a short text beside it, or none; intervals: drawn as whiskers."""

    style: Style
    filled: bool
    accuracy: float
    precision: float
    accuracy_interval: tuple[float, float] | None = None
    precision_interval: tuple[float, float] | None = None
    tag: str = ""


@dataclass(frozen=True)
class Panel:
    """One quantity of all methods."""

    quantity: Measure
    points: Sequence[Point]


@printed
def precision_accuracy_figure(
    panels: Sequence[Panel],
    rows: Sequence[Row],
    key: Sequence[KeyLine],
    width: Width,
    units: UnitSystem,
    scales: Sequence[Scale] | None = None,
) -> Figure:
    """Draw a panel for each quantity; rows and key beside them, or below if they are many. scales: else from points."""
    scales = scales or [scatter_scale(panel.points) for panel in panels]
    legend = Legend(rows, "completeness, %", key)
    figure, drawn = figure_with_panels(len(panels), legend, width, _SIDES, lambda panel, _: panel)
    for axes, panel, scale in zip(drawn, panels, scales, strict=True):
        draw_precision_accuracy(axes, panel.points, scale, panel.quantity, units)
    for axes, panel in zip(drawn, panels, strict=True):
        add_tags(axes, [((point.accuracy, point.precision), point.tag) for point in panel.points])
    return figure


def scatter_scale(points: Sequence[Point], linear: bool = False) -> Scale:
    """One scale for both directions: all markers, and the whiskers as far as they let the markers stay apart."""
    values = []
    for point in points:
        for value, interval in (
            (point.accuracy, point.accuracy_interval),
            (point.precision, point.precision_interval),
        ):
            ends = [min(max(end, value / _FARTHEST), value * _FARTHEST) for end in interval or ()]
            values += [value, *ends]
    return scale_of(values, linear=linear)


def draw_precision_accuracy(
    axes: Axes, points: Sequence[Point], scale: Scale, quantity: Measure, units: UnitSystem
) -> None:
    """Draw one panel: precision upwards over accuracy rightwards."""
    set_axis(axes, "x", scale, quantity, units, f"accuracy {quantity.accuracy}")
    set_axis(axes, "y", scale, quantity, units, f"precision {quantity.precision}")
    add_grid(axes)
    add_parity(axes, scale, f"{quantity.precision} = {quantity.accuracy}")
    for point in points:
        whisker: dict[str, Any] = {"color": point.style.colour, "linewidth": 0.6, "alpha": 0.7, "zorder": 2}
        if point.accuracy_interval is not None:
            axes.plot(point.accuracy_interval, [point.precision] * 2, **whisker)
        if point.precision_interval is not None:
            axes.plot([point.accuracy] * 2, point.precision_interval, **whisker)
    # Hollow markers last: a filled one would hide them.
    for point in sorted(points, key=lambda point: not point.filled):
        at = scale.held(point.accuracy), scale.held(point.precision)
        axes.plot(*at, linestyle="none", zorder=3, **marker_style(point.style, point.filled))
    if not points:
        say_empty(axes)


def tags_of(count: int) -> list[str]:
    """What is written beside the markers of so many methods: their numbers in the legend, where they are many."""
    return [str(number) if count > _NUMBERED_ABOVE else "" for number in range(1, count + 1)]
