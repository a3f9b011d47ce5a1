"""Cumulative precision: the share of planned waypoints with E below x, and N-AUC, the area below it (protocol 5.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from taskslam.geometry import FloatArray
from taskslam.report.figures.bars import KeyLine, Row
from taskslam.report.figures.panels import Legend, figure_with_panels
from taskslam.report.figures.scales import Measure, Scale, UnitSystem, add_grid, scale_of, set_axis
from taskslam.report.figures.style import (
    NORMAL,
    Width,
    line_style,
    marker_style,
    printed,
    say_empty,
)
from taskslam.report.figures.tags import add_tags
from taskslam.report.markers import Style
from taskslam.report.step_curve import step_corners

_SIDES = (0.42, 0.12)  # in: left and right of a panel, for its ticks and labels
_LEVELS = (0.5, 0.3, 0.7)  # of its own rise: where a curve bears its marker, in turn


@dataclass(frozen=True)
class Curve:
    """One method in one mode. precisions: E of complete waypoints in the quantity's unit; planned: all waypoints."""

    style: Style
    filled: bool
    precisions: tuple[float, ...]
    planned: int
    tag: str = ""


@dataclass(frozen=True)
class Panel:
    """The curves of one mode."""

    title: str
    curves: Sequence[Curve]


@dataclass(frozen=True)
class Labels:
    """What the axes of a panel say."""

    along: str
    up: str


WAYPOINTS = Labels("precision E", "waypoints below (%)")


@printed
def cumulative_figure(
    panels: Sequence[Panel],
    rows: Sequence[Row],
    key: Sequence[KeyLine],
    heading: str,
    quantity: Measure,
    limit: float,
    width: Width,
    units: UnitSystem,
    labels: Labels = WAYPOINTS,
    linear: bool = False,
) -> Figure:
    """Draw a panel for each mode on one scale, and beside or below them the rows of what the curves amount to.

    limit: the axis reaches so far; linear: from 0, always.
    """
    values = [value for panel in panels for curve in panel.curves for value in curve.precisions]
    scale = scale_of(values, least=limit, linear=linear)
    figure, drawn = figure_with_panels(len(panels), Legend(rows, heading, key), width, _SIDES, _panel_height)
    for axes, panel in zip(drawn, panels, strict=True):
        _draw_panel(axes, panel, scale, quantity, units, labels)
    for axes, panel in zip(drawn, panels, strict=True):
        add_tags(axes, [(at, curve.tag) for curve, at in _marks(panel.curves, scale)])
    return figure


def _panel_height(width: float, beside: float) -> float:
    """Many methods make long rows: the panels beside them grow with them."""
    return min(max(1.5, min(0.8 * width, 2.2), beside), 1.3 * width)


def steps(curve: Curve, scale: Scale) -> FloatArray:
    """(K, 2) corners of a curve from end to end of the axis: x in the quantity's unit, y in percent."""
    return step_corners(curve.precisions, curve.planned, scale.low, scale.high) * [1.0, 100.0]


def _draw_panel(axes: Axes, panel: Panel, scale: Scale, quantity: Measure, units: UnitSystem, labels: Labels) -> None:
    set_axis(axes, "x", scale, quantity, units, labels.along)
    axes.set_ylim(0, 103)
    axes.set_yticks([0, 25, 50, 75, 100])
    axes.set_ylabel(labels.up)
    axes.text(0.97, 0.04, panel.title, transform=axes.transAxes, ha="right", fontsize=NORMAL, fontweight="bold")
    add_grid(axes)
    for curve in reversed(panel.curves):  # the best on top
        points = steps(curve, scale)
        axes.plot(points[:, 0], points[:, 1], **line_style(curve.style))
    for curve, at in reversed(_marks(panel.curves, scale)):
        axes.plot(*at, linestyle="none", zorder=3, **marker_style(curve.style, curve.filled))
    if not panel.curves:
        say_empty(axes)


def _marks(curves: Sequence[Curve], scale: Scale) -> list[tuple[Curve, tuple[float, float]]]:
    """Where each curve that rises bears its marker: at a step, in the middle of its height."""
    marks = []
    for index, curve in enumerate(curves):
        inside = sorted(value for value in curve.precisions if value < scale.high)
        if inside:
            step = min(int(_LEVELS[index % len(_LEVELS)] * len(inside)), len(inside) - 1)
            marks.append((curve, (scale.held(inside[step]), 100.0 * (step + 0.5) / curve.planned)))
    return marks
