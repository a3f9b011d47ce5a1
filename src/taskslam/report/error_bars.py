"""Bars for a table cell: control error above estimation error, with what varies from round to round as whiskers."""

from __future__ import annotations

from markupsafe import Markup

from taskslam.evaluation import RunMetrics, WaypointMetrics
from taskslam.evaluation.metrics_file import ErrorShare
from taskslam.report import palette
from taskslam.report.svg import Svg

_WIDTH = 240.0


def bar_limit(metrics: RunMetrics) -> float:
    """The longest bar with its whisker over all waypoints of a run, metres."""
    ends = [
        (share.position_m or 0.0) + (share.spread_m or 0.0)
        for waypoint in metrics.waypoints
        for share in (waypoint.control, waypoint.estimation)
    ]
    return max([*ends, 0.01])


def error_bars(waypoint: WaypointMetrics, limit_m: float) -> Markup:
    """Draw the two bars of one waypoint; `limit_m` is the full width."""
    svg = Svg(_WIDTH, 22, f"Control and estimation error at waypoint {waypoint.goal + 1}")
    for y, share, colour in ((1.0, waypoint.control, palette.CONTROL), (12.0, waypoint.estimation, palette.ESTIMATION)):
        _draw_bar(svg, share, colour, y, (_WIDTH - 2) / limit_m)
    return svg.markup()


def _draw_bar(svg: Svg, share: ErrorShare, colour: str, y: float, scale: float) -> None:
    if share.position_m is None:
        return
    end = share.position_m * scale
    svg.add("rect", x=0, y=y, width=max(end, 1.0), height=9, rx=1.5, fill=colour)
    if share.spread_m is not None:
        low, high = max(end - share.spread_m * scale, 0.0), end + share.spread_m * scale
        svg.line(low, y + 4.5, high, y + 4.5, stroke=palette.INK, stroke_width=1.2)
        for x in (low, high):
            svg.line(x, y + 2, x, y + 7, stroke=palette.INK, stroke_width=1.2)
