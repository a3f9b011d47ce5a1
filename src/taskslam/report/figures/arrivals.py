"""The arrivals of one run, waypoint by waypoint: enlarged about their mean, and small about the goal.

Each panel is turned so that the goal's heading points up. Every round is a dot with its heading, later rounds darker;
the circle about the mean has the radius E. The inset below shows the same dots against the goal and the tolerance
of navigation, so precision is read above and accuracy below.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch

from taskslam.evaluation import WaypointMetrics
from taskslam.geometry import SE2
from taskslam.report import palette, words
from taskslam.report.figures.lettering import draw_title
from taskslam.report.figures.style import WIDTHS, Width, add_axes, new_figure, printed
from taskslam.report.goal_frame import middle, seen_from_goal
from taskslam.task import GoalTolerance

_SIDE, _FOOT, _GAP, _TOP, _EDGE = 1.06, 0.42, 0.09, 0.36, 0.03  # in: a panel, the strip below it, between, above, edge
_INSET = 0.38  # in
_ARROW = 0.17  # in
# Half a panel's width, and a scale bar that suits it, both in metres.
_ZOOMS = tuple(
    (half * ten, bar * ten)
    for ten in (0.001, 0.01, 0.1, 1.0, 10.0, 100.0)
    for half, bar in ((1.0, 0.5), (2.0, 1.0), (5.0, 2.0))
)


@dataclass(frozen=True)
class _Panel:
    """A waypoint's true arrivals in its goal's frame, by round; zoom: index of the closest one that fits."""

    waypoint: WaypointMetrics
    truths: tuple[tuple[int, SE2], ...]
    mean: tuple[float, float]
    zoom: int


@printed
def arrivals_figure(
    waypoints: Sequence[WaypointMetrics], rounds: Sequence[int], tolerance: GoalTolerance, colour: str, title: str,
    width: Width,
) -> Figure:  # fmt: skip
    """Draw all waypoints of a run. rounds: numbers of the rounds that count, as in arrivals; colour: the method's."""
    panels = [_panel(waypoint) for waypoint in waypoints]
    zooms = sorted(panel.zoom for panel in panels if panel.truths) or [_zoom(tolerance.position_m)]
    common = zooms[math.ceil(0.75 * len(zooms)) - 1]  # one scale for most of them; wider ones zoom out
    across = int((WIDTHS[width] + _GAP - 2 * _EDGE) / (_SIDE + _GAP))
    step = (WIDTHS[width] - 2 * _EDGE - _SIDE) / (across - 1)
    down = math.ceil(len(panels) / across)
    row = _SIDE + _FOOT + _GAP
    figure = new_figure(WIDTHS[width], _TOP + down * row, constrained=False)
    shades = {number: _shade(colour, index, len(rounds)) for index, number in enumerate(rounds)}
    for index, panel in enumerate(panels):
        left, top = _EDGE + index % across * step, _TOP + index // across * row
        _draw_panel(add_axes(figure, left, top, _SIDE, _SIDE), panel, max(panel.zoom, common), tolerance, shades)
        _draw_foot(add_axes(figure, left, top + _SIDE, _SIDE, _FOOT), panel)
        inset = add_axes(figure, left + _SIDE - _INSET - 0.02, top + _SIDE + (_FOOT - _INSET) / 2, _INSET, _INSET)
        _draw_inset(inset, panel, tolerance, shades)
    _draw_head(figure, title, shades)
    return figure


def _panel(waypoint: WaypointMetrics) -> _Panel:
    truths = tuple((visit.round, truth) for visit, truth, _ in seen_from_goal(waypoint) if truth is not None)
    mean = middle(waypoint)
    reach = max((math.hypot(pose.x - mean[0], pose.y - mean[1]) for _, pose in truths), default=0.0)
    return _Panel(waypoint, truths, mean, _zoom(reach))


def _zoom(reach: float) -> int:
    """Index of the closest zoom that shows so many metres about its middle."""
    return next((index for index, (half, _) in enumerate(_ZOOMS) if 1.25 * reach <= half), len(_ZOOMS) - 1)


def _draw_panel(axes: Axes, panel: _Panel, zoom: int, tolerance: GoalTolerance, shades: dict[int, str]) -> None:
    half, bar = _ZOOMS[zoom]
    _frame(axes, panel.mean, half)
    waypoint = panel.waypoint
    axes.add_patch(_circle((0.0, 0.0), tolerance.position_m, edgecolor=palette.MUTED, linestyle=(0, (3, 2))))
    _draw_goal(axes, 7.0)
    if len(panel.truths) > 1:
        E = waypoint.position.precision_m or 0.0
        colour = list(shades.values())[-1]
        axes.add_patch(_circle(panel.mean, E, facecolor=colour, alpha=0.12, linewidth=0))
        axes.add_patch(_circle(panel.mean, E, edgecolor=colour, linewidth=0.6))
        axes.plot(-panel.mean[1], panel.mean[0], "x", color=palette.INK, markersize=3.5, markeredgewidth=0.8, zorder=4)
    ahead = _ARROW / _SIDE * 2 * half
    for number, pose in panel.truths:
        tip = pose @ SE2(ahead, 0.0, 0.0)
        axes.add_patch(
            FancyArrowPatch((-pose.y, pose.x), (-tip.y, tip.x), arrowstyle="-|>", mutation_scale=4, linewidth=0.8,
                            shrinkA=0, shrinkB=0, color=shades[number])
        )  # fmt: skip
        axes.plot(-pose.y, pose.x, "o", color=shades[number], markersize=3.4, markeredgecolor="white",
                  markeredgewidth=0.4, zorder=3)  # fmt: skip
    missed = waypoint.visits < waypoint.rounds
    ink: dict[str, Any] = {"color": palette.FAILURE, "fontweight": "bold"} if missed else {"color": palette.MUTED}
    axes.text(0.04, 0.96, str(waypoint.goal + 1), transform=axes.transAxes, va="top", fontweight="bold")
    axes.text(0.96, 0.96, f"{waypoint.visits}/{waypoint.rounds}", transform=axes.transAxes, va="top", ha="right", **ink)
    if not panel.truths:
        axes.text(0.5, 0.3, "no true pose" if waypoint.visits else "never reached", transform=axes.transAxes,
                  ha="center", color=palette.FAILURE)  # fmt: skip
    x, y = axes.transData.inverted().transform(axes.transAxes.transform((0.05, 0.06)))
    axes.plot([x, x + bar], [y, y], color=palette.INK, linewidth=1.2, solid_capstyle="butt")
    axes.annotate(_length(bar), (x, y), (0, 2), textcoords="offset points")


def _draw_foot(axes: Axes, panel: _Panel) -> None:
    axes.set_axis_off()
    position = panel.waypoint.position
    for y, letter, value in ((0.72, "E", position.precision_m), (0.36, "e", position.accuracy_m)):
        text = words.with_unit(words.centimetres(value), "cm")
        axes.text(0.0, y, f"{letter} {text}", transform=axes.transAxes, va="center")


def _draw_inset(axes: Axes, panel: _Panel, tolerance: GoalTolerance, shades: dict[int, str]) -> None:
    reach = max((math.hypot(pose.x, pose.y) for _, pose in panel.truths), default=0.0)
    _frame(axes, (0.0, 0.0), 1.12 * max(tolerance.position_m, reach))
    axes.set_axis_off()
    axes.add_patch(
        _circle((0, 0), tolerance.position_m, facecolor=palette.TRACK, edgecolor=palette.MUTED, linestyle=(0, (2, 1.5)))
    )
    _draw_goal(axes, 3.5)
    for number, pose in panel.truths:
        axes.plot(-pose.y, pose.x, "o", color=shades[number], markersize=1.8, markeredgewidth=0, zorder=3)


def _draw_goal(axes: Axes, size: float) -> None:
    """A cross with its heading upwards, size in points."""
    axes.plot(0, 0, "+", color=palette.INK, markersize=size, markeredgewidth=0.7, zorder=2)
    axes.annotate("", (0, 0), (0, 2.2 * size), textcoords="offset points", arrowprops={
        "arrowstyle": "<|-", "linewidth": 0.7, "mutation_scale": size * 0.7, "color": palette.INK, "shrinkA": 0,
        "shrinkB": 0}, zorder=2)  # fmt: skip


def _draw_head(figure: Figure, title: str, shades: dict[int, str]) -> None:
    height = figure.get_size_inches()[1]
    draw_title(figure, title)
    colours = list(shades.values())  # none where the run ended in its priming round
    ends = [("first round", colours[0]), ("last", colours[-1])] if colours else []
    dot: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 3.4, "markeredgewidth": 0}
    handles = [Line2D([], [], color=colour, label=label, **dot) for label, colour in ends]
    handles += [Line2D([], [], color=palette.INK, linestyle="none", marker="x", markersize=3.5, label="mean")]
    handles += [Line2D([], [], color=palette.INK, linestyle="none", marker="+", markersize=6, label="goal")]
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0, 1 - 0.15 / height), ncols=5, handlelength=1.0,
                  columnspacing=1.0, handletextpad=0.2, borderaxespad=0.1)  # fmt: skip


def _frame(axes: Axes, centre: tuple[float, float], half: float) -> None:
    """Show a square about a point of the goal's frame: x, ahead, is up, and y, left, is left."""
    axes.set_xlim(-centre[1] - half, -centre[1] + half)
    axes.set_ylim(centre[0] - half, centre[0] + half)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set_color(palette.HAIRLINE)


def _circle(centre: tuple[float, float], radius: float, **ink: Any) -> Circle:
    return Circle((-centre[1], centre[0]), radius, **{"fill": "facecolor" in ink, "linewidth": 0.6, **ink})


def _shade(colour: str, index: int, count: int) -> str:
    """The method's colour, lighter for earlier rounds."""
    share = 1.0 if count < 2 else 0.4 + 0.6 * index / (count - 1)
    red, green, blue = (1 - share * (1 - part) for part in to_rgb(colour))
    return f"#{round(255 * red):02x}{round(255 * green):02x}{round(255 * blue):02x}"


def _length(metres: float) -> str:
    value, unit = (metres * 1000, "mm") if metres < 0.01 else (metres * 100, "cm") if metres < 1 else (metres, "m")
    return f"{value:g} {unit}"
