"""The arrivals at one waypoint, enlarged and turned so that the goal's heading points up.

The panel is centred on the mean arrival, so that the spread (precision) fills it; the inset below shows where that
lies against the goal and the tolerance of navigation (accuracy).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from taskslam.evaluation import WaypointMetrics
from taskslam.geometry import SE2
from taskslam.report import palette
from taskslam.report.goal_frame import middle, seen_from_goal
from taskslam.report.svg import Svg
from taskslam.report.units import METRIC, TASK, Units, draw_length
from taskslam.task import GoalTolerance

_SIZE = 200.0
_INSET = 66.0
# Half a panel's width in metres, and a scale bar that suits it.
_ZOOMS = (
    (0.0025, 0.001, "1 mm"),
    (0.005, 0.002, "2 mm"),
    (0.008, 0.002, "2 mm"),
    (0.0125, 0.005, "5 mm"),
    (0.02, 0.005, "5 mm"),
    (0.03, 0.01, "1 cm"),
    (0.05, 0.02, "2 cm"),
    (0.08, 0.02, "2 cm"),
    (0.125, 0.05, "5 cm"),
    (0.2, 0.05, "5 cm"),
    (0.3, 0.1, "10 cm"),
    (0.5, 0.2, "20 cm"),
    (1.0, 0.5, "50 cm"),
    (2.5, 1.0, "1 m"),
    (5.0, 2.0, "2 m"),
    (10.0, 5.0, "5 m"),
    (25.0, 10.0, "10 m"),
    (100.0, 50.0, "50 m"),
)


@dataclass(frozen=True)
class _Window:
    """From the goal's frame (x ahead, y left) to a square of the drawing with ahead up."""

    x: float
    y: float
    size: float
    centre: tuple[float, float]
    half: float

    @property
    def scale(self) -> float:
        return self.size / 2 / self.half

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Drawing coordinates of a point of the goal's frame."""
        return (
            self.x + self.size / 2 - (y - self.centre[1]) * self.scale,
            self.y + self.size / 2 - (x - self.centre[0]) * self.scale,
        )


def arrivals_figures(
    waypoints: Sequence[WaypointMetrics], tolerance: GoalTolerance, units: Units, in_map: bool = True
) -> list[Markup]:
    """Draw one panel for each waypoint, each enlarged until its arrivals fill it.

    in_map: whether true poses compare with the goal; else the panel shows neither goal nor what SLAM believed.
    """
    return [_draw_panel(_panel(waypoint, in_map), tolerance.position_m, units, in_map) for waypoint in waypoints]


@dataclass(frozen=True)
class _Panel:
    """A waypoint's visits in its goal's frame, truth and belief of each; zoom: index of the closest zoom that fits."""

    waypoint: WaypointMetrics
    visits: tuple[tuple[SE2 | None, SE2 | None], ...]
    mean: tuple[float, float]
    zoom: int

    @property
    def truths(self) -> list[SE2]:
        return [truth for truth, _ in self.visits if truth is not None]


def _panel(waypoint: WaypointMetrics, in_map: bool) -> _Panel:
    poses = tuple((truth, belief if in_map else None) for _, truth, belief in seen_from_goal(waypoint))
    mean = middle(waypoint)
    reach = max(
        (max(abs(pose.x - mean[0]), abs(pose.y - mean[1])) for pair in poses for pose in pair if pose is not None),
        default=0.0,
    )
    zoom = next((index for index, (half, _, _) in enumerate(_ZOOMS) if 1.15 * reach <= half), len(_ZOOMS) - 1)
    return _Panel(waypoint, poses, mean, zoom)


def _draw_panel(panel: _Panel, tolerance: float, units: Units, in_map: bool) -> Markup:
    waypoint = panel.waypoint
    half, bar, bar_label = _ZOOMS[panel.zoom]
    window = _Window(0.0, 0.0, _SIZE, panel.mean, half)
    label = f"Arrivals at waypoint {waypoint.goal + 1}: {waypoint.visits} of {waypoint.rounds} rounds"
    svg = Svg(_SIZE, _SIZE + _INSET + 12, label)
    with svg.window(_SIZE, _SIZE):
        goal = window.place(0.0, 0.0)
        if in_map:
            svg.circle(*goal, tolerance * window.scale, fill="none", stroke=palette.MUTED, stroke_dasharray="3 3")
        if in_map and all(0 < coordinate < _SIZE for coordinate in goal):
            _draw_goal(svg, *goal, 1.0)
        if len(panel.truths) > 1:
            _draw_mean(svg, *window.place(*panel.mean), (waypoint.position.precision_m or 0.0) * window.scale)
        for truth, belief in panel.visits:
            _draw_visit(svg, truth, belief, window)
    if waypoint.unjudged is not None and not panel.truths:
        svg.text(_SIZE / 2, _SIZE / 2, "not measured", fill=palette.MUTED, font_size=13, text_anchor="middle")
    elif not waypoint.visits:
        svg.text(_SIZE / 2, _SIZE / 2 + 40, "never reached", fill=palette.FAILURE, font_size=13, text_anchor="middle")
    svg.line(0, _SIZE, _SIZE, _SIZE, stroke=palette.HAIRLINE)
    if in_map:
        _draw_inset(svg, panel.truths, tolerance)
    _draw_scale_bar(svg, bar, bar_label, window.scale, units)
    for row, (name, value) in enumerate((("E", waypoint.position.precision_m), ("e", waypoint.position.accuracy_m))):
        y = _SIZE + 45 + 18 * row
        svg.text(10, y, name, fill=palette.MUTED, font_size=13)
        draw_length(svg, 26.0, y, value, units, unit=True, fill=palette.INK, font_size=13)
    return svg.markup()


def _draw_mean(svg: Svg, x: float, y: float, radius: float) -> None:
    """The circle of radius E with a cross in its middle."""
    svg.circle(x, y, radius, fill=palette.TRUTH, fill_opacity=0.12, stroke=palette.TRUTH, stroke_width=0.8)
    for dx, dy in ((3.5, 3.5), (3.5, -3.5)):
        svg.line(x - dx, y - dy, x + dx, y + dy, stroke=palette.INK, stroke_width=1.1)


def _draw_visit(svg: Svg, truth: SE2 | None, belief: SE2 | None, window: _Window) -> None:
    """The true pose as a dot with its heading, joined to the ring where SLAM said it was."""
    if belief is not None:
        at = window.place(belief.x, belief.y)
        if truth is not None:
            svg.line(*at, *window.place(truth.x, truth.y), stroke=palette.BELIEF, stroke_width=1, stroke_opacity=0.7)
        svg.circle(*at, 3.4, fill=palette.PAPER, stroke=palette.BELIEF, stroke_width=1.7)
    if truth is not None:
        x, y = window.place(truth.x, truth.y)
        ahead_x, ahead_y = x - 17 * math.sin(truth.theta), y - 17 * math.cos(truth.theta)
        svg.line(x, y, ahead_x, ahead_y, stroke=palette.TRUTH, stroke_width=1.6, stroke_linecap="round")
        svg.circle(x, y, 3.4, fill=palette.TRUTH, stroke=palette.PAPER, stroke_width=0.9)


def _draw_inset(svg: Svg, truths: list[SE2], tolerance: float) -> None:
    reach = max((max(abs(truth.x), abs(truth.y)) for truth in truths), default=0.0)
    window = _Window(_SIZE - _INSET - 6, _SIZE + 6.0, _INSET, (0.0, 0.0), 1.15 * max(tolerance, reach))
    goal = window.place(0.0, 0.0)
    dashed: dict[str, Any] = {"stroke": palette.MUTED, "stroke_width": 0.8, "stroke_dasharray": "2 2"}
    svg.circle(*goal, tolerance * window.scale, fill=palette.TINT, **dashed)
    _draw_goal(svg, *goal, 0.55)
    for truth in truths:
        svg.circle(*window.place(truth.x, truth.y), 1.6, fill=palette.TRUTH)


def _draw_goal(svg: Svg, x: float, y: float, size: float) -> None:
    """A cross with an arrow ahead."""
    ink = {"stroke": palette.INK, "stroke_width": 1.3 * size + 0.2}
    svg.line(x - 7 * size, y, x + 7 * size, y, **ink)
    svg.line(x, y + 7 * size, x, y - 24 * size, **ink)
    head = np.array([[x - 5 * size, y - 18 * size], [x, y - 24 * size], [x + 5 * size, y - 18 * size]])
    svg.polyline(head, stroke_linejoin="round", **ink)


def _draw_scale_bar(svg: Svg, metres: float, label: str, scale: float, units: Units) -> None:
    left, y = 10.0, _SIZE + 20.0
    end = left + metres * scale
    svg.line(left, y - 4, end, y - 4, stroke=palette.INK, stroke_width=1.5)
    for x in (left, end):
        svg.line(x, y - 7.5, x, y - 0.5, stroke=palette.INK, stroke_width=1.5)
    ink = {"fill": palette.INK, "font_size": 12.5}
    svg.text(end + 7, y, label, class_=METRIC, **ink)
    if units.diameter_m is not None:
        svg.text(end + 7, y, f"{metres / units.diameter_m:.2g} D", class_=TASK, **ink)
