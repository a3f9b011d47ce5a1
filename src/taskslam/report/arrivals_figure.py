"""The arrivals at one waypoint, enlarged and turned so that the goal's heading points up."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup

from taskslam.evaluation import WaypointMetrics
from taskslam.geometry import SE2
from taskslam.record import GoalTolerance
from taskslam.report import palette
from taskslam.report.svg import Svg

_SIZE = 180.0
_HALF_WIDTHS = (0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)  # m from the goal to the panel's edge
_BARS = {0.25: "10 cm", 0.5: "20 cm", 1.0: "50 cm", 2.0: "1 m", 5.0: "2 m", 10.0: "5 m", 20.0: "10 m"}
_BAR_METRES = {"10 cm": 0.1, "20 cm": 0.2, "50 cm": 0.5, "1 m": 1.0, "2 m": 2.0, "5 m": 5.0, "10 m": 10.0, "20 m": 20.0}


def arrivals_figure(waypoint: WaypointMetrics, tolerance: GoalTolerance) -> Markup:
    """Draw a panel: the goal with its tolerance, true poses, believed positions, mean and radius E."""
    T_goal_map = SE2(*waypoint.target).inverse()
    truths = [T_goal_map @ SE2(*visit.truth) for visit in waypoint.arrivals if visit.truth is not None]
    beliefs = [T_goal_map @ SE2(*visit.estimate) for visit in waypoint.arrivals if visit.estimate is not None]
    half = _half_width([*truths, *beliefs])
    scale = (_SIZE / 2 - 8) / half
    centre = _SIZE / 2
    svg = Svg(_SIZE, _SIZE + 22, f"Arrivals at waypoint {waypoint.goal + 1}: {waypoint.visits} of {waypoint.rounds}")
    svg.add("rect", x=0.5, y=0.5, width=_SIZE - 1, height=_SIZE - 1, rx=6, fill="#ffffff", stroke=palette.HAIRLINE)
    radius = tolerance.position_m * scale
    svg.circle(centre, centre, radius, fill="#f4f6f8", stroke=palette.MUTED, stroke_width=1, stroke_dasharray="3 3")
    _draw_goal(svg, centre)

    def place(pose: SE2) -> tuple[float, float]:
        """Goal frame, x ahead and y left, to the drawing: ahead is up."""
        return centre - pose.y * scale, centre - pose.x * scale

    for belief in beliefs:
        svg.circle(*place(belief), 3.2, fill="none", stroke=palette.BELIEF, stroke_width=1.6)
    if waypoint.mean_pose is not None and len(truths) > 1:
        mean = place(T_goal_map @ SE2(*waypoint.mean_pose))
        spread = (waypoint.position.precision_m or 0.0) * scale
        svg.circle(*mean, spread, fill=palette.TRUTH, fill_opacity=0.13, stroke=palette.TRUTH, stroke_width=0.8)
    for truth in truths:
        x, y = place(truth)
        tip_x, tip_y = x - 13 * math.sin(truth.theta), y - 13 * math.cos(truth.theta)
        svg.line(x, y, tip_x, tip_y, stroke=palette.TRUTH, stroke_width=1.3, stroke_linecap="round")
        svg.circle(x, y, 2.8, fill=palette.TRUTH, stroke="#ffffff", stroke_width=0.8)
    if not waypoint.visits:
        svg.text(centre, centre + 34, "never reached", fill=palette.FAILURE, font_size=12, text_anchor="middle")
    _draw_scale_bar(svg, half, scale)
    return svg.markup()


def _half_width(poses: list[SE2]) -> float:
    """The smallest of a few round widths that holds every pose."""
    reach = max((max(abs(pose.x), abs(pose.y)) for pose in poses), default=0.0)
    return next((half for half in _HALF_WIDTHS if reach <= half), _HALF_WIDTHS[-1])


def _draw_goal(svg: Svg, centre: float) -> None:
    """A cross with an arrow ahead."""
    ink = {"stroke": palette.INK, "stroke_width": 1.2}
    svg.line(centre - 6, centre, centre + 6, centre, **ink)
    svg.line(centre, centre + 6, centre, centre - 22, **ink)
    tip = np.array([[centre - 4, centre - 17], [centre, centre - 22], [centre + 4, centre - 17]])
    svg.polyline(tip, stroke_linejoin="round", **ink)


def _draw_scale_bar(svg: Svg, half: float, scale: float) -> None:
    label = _BARS.get(half, "20 m")
    length = _BAR_METRES[label] * scale
    y = _SIZE + 13.0
    svg.line(1.0, y, 1 + length, y, stroke=palette.INK, stroke_width=1.4)
    for x in (1.0, 1 + length):
        svg.line(x, y - 3.5, x, y + 3.5, stroke=palette.INK, stroke_width=1.4)
    svg.text(length + 8, y + 4, label, fill=palette.MUTED, font_size=12)
