"""Bars for a table cell: control error above estimation error, with what varies from round to round as whiskers."""

from __future__ import annotations

from markupsafe import Markup

from taskslam.evaluation import RunMetrics
from taskslam.evaluation.metrics_file import ErrorShare
from taskslam.report import palette
from taskslam.report.svg import Svg
from taskslam.report.units import Units, draw_length

_WIDTH, _HEIGHT = 300.0, 30.0
_LABEL = 42.0  # room for a number at the end of the longest bar


def bar_limit(metrics: RunMetrics) -> float:
    """The longest bar with its whisker over all waypoints of a run, metres."""
    ends = [
        (share.position_m or 0.0) + (share.spread_m or 0.0)
        for waypoint in metrics.waypoints
        for share in (waypoint.control, waypoint.estimation)
    ]
    return max([*ends, 0.01])


def error_bars(control: ErrorShare, estimation: ErrorShare, limit_m: float, units: Units) -> Markup:
    """Draw the two bars with their values; `limit_m` is the full width."""
    svg = Svg(_WIDTH, _HEIGHT, "Control and estimation error")
    scale = (_WIDTH - _LABEL) / limit_m
    _draw_bar(svg, control, palette.CONTROL, 2.0, scale, units)
    _draw_bar(svg, estimation, palette.ESTIMATION, 17.0, scale, units)
    return svg.markup()


def _draw_bar(svg: Svg, share: ErrorShare, colour: str, y: float, scale: float, units: Units) -> None:
    if share.position_m is None:
        return
    end = share.position_m * scale
    svg.add("rect", x=0, y=y, width=max(end, 1.0), height=7, rx=1.5, fill=colour)
    label_at = end
    if share.spread_m is not None:
        low, high = max(end - share.spread_m * scale, 0.0), end + share.spread_m * scale
        # Beneath the bar: across it, a whisker looks like a bar that is broken.
        svg.line(low, y + 10, high, y + 10, stroke=palette.INK, stroke_width=1.2)
        for x in (low, high):
            svg.line(x, y + 8, x, y + 12, stroke=palette.INK, stroke_width=1.2)
        label_at = high
    draw_length(svg, label_at + 6, y + 10, share.position_m, units, unit=False, fill=palette.INK, font_size=12.5)
