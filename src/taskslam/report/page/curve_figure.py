"""The cumulative precision curve: which share of the planned waypoints has a precision below x (protocol 5.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from taskslam.mode import Mode
from taskslam.report import palette
from taskslam.report.markers import Style, draw_marker
from taskslam.report.step_curve import step_corners
from taskslam.report.svg import Svg

_LEFT, _TOP, _RIGHT, _BOTTOM = 46.0, 34.0, 20.0, 44.0
_SIZE = (520.0, 340.0)


@dataclass(frozen=True)
class Curve:
    """One line. precisions: E in metres of the complete waypoints; planned: all waypoints; marked: with a marker.

    name: what a pointer resting on the line is told.
    """

    precisions: tuple[float, ...]
    planned: int
    style: Style
    dashed: bool
    marked: bool = False
    name: str = ""


def curve_figure(
    curves: list[Curve],
    limit_m: float,
    diameter_m: float | None,
    size: tuple[float, float] = _SIZE,
    label: str = "position precision E below, cm",
) -> Markup:
    """Draw the step curves from 0 to `limit_m`, with a second axis in robot diameters D above if there is one D.

    label: of the axis.
    """
    plot_w, plot_h = size[0] - _LEFT - _RIGHT, size[1] - _TOP - _BOTTOM
    svg = Svg(*size, f"Cumulative precision of {len(curves)} runs up to {limit_m * 100:.0f} cm")

    def x_of(metres: float) -> float:
        return _LEFT + metres / limit_m * plot_w

    def y_of(share: float) -> float:
        return _TOP + (1 - share) * plot_h

    _draw_axes(svg, label, limit_m, diameter_m, x_of(0.0), x_of(limit_m), y_of(0.0), y_of(1.0))
    for curve in reversed(curves):  # the best on top
        steps = step_corners(curve.precisions, curve.planned, 0.0, limit_m)
        points = np.column_stack([[x_of(x) for x in steps[:, 0]], [y_of(y) for y in steps[:, 1]]])
        dash = {"stroke_dasharray": "7 4"} if curve.dashed else {}
        with svg.group(data_method=curve.style.key, data_mode=Mode.WITHOUT_MAP if curve.dashed else Mode.WITH_MAP):
            svg.add("title", f"{curve.name}: {len(curve.precisions)} of {curve.planned} on the curve")
            svg.polyline(points, stroke=curve.style.colour, stroke_width=2.4, stroke_linejoin="round", **dash)
            rises = np.flatnonzero(steps[:, 1] > 0)
            if curve.marked and len(rises):
                # Half way up its own rise, where the lines lie furthest apart.
                x, y = points[int(np.argmax(steps[:, 1] >= steps[-1, 1] / 2))]
                draw_marker(svg, curve.style, float(x), float(y), 5.0)
    return svg.markup()


def enlarged_limit(curves: list[Curve], diameter_m: float, least: float = 0.0) -> float:
    """The end of an axis that shows where the curves rise: a few fractions of D, at most half of it if none fits.

    least: it shows at least so many metres.
    """
    largest = max((value for curve in curves for value in curve.precisions), default=0.0)
    fitting = (
        share * diameter_m
        for share in (0.05, 0.1, 0.2, 0.5, 1.0, 2.0)
        if share * diameter_m >= max(1.1 * largest, least)
    )
    return next(fitting, diameter_m / 2)


def _tick(limit: float) -> float:
    """A round step in metres that divides the axis into at most eight parts."""
    for centimetres in (0.1, 0.25, 0.5, 1, 2, 3, 5, 10, 15, 20, 30, 50, 100):
        parts = limit * 100 / centimetres
        if parts <= 8 + 1e-9 and abs(parts - round(parts)) < 1e-9:
            return centimetres / 100
    return limit / 4


def _draw_axes(
    svg: Svg, label: str, limit: float, diameter: float | None, left: float, right: float, bottom: float, top: float
) -> None:
    tick = _tick(limit)
    with svg.group(font_size=12, fill=palette.MUTED):
        for percent in (0, 25, 50, 75, 100):
            y = bottom + (top - bottom) * percent / 100
            svg.line(left, y, right, y, stroke=palette.HAIRLINE, stroke_width=1)
            svg.text(left - 8, y + 4, f"{percent} %", text_anchor="end")
        for index in range(round(limit / tick) + 1):
            x = left + (right - left) * index * tick / limit
            svg.line(x, bottom, x, bottom + 5, stroke=palette.MUTED, stroke_width=1)
            svg.text(x, bottom + 19, f"{index * tick * 100:g}", text_anchor="middle")
        if diameter is not None:
            _draw_diameters(svg, limit, diameter, left, right, top)
        svg.text((left + right) / 2, bottom + 38, label, text_anchor="middle")


def _draw_diameters(svg: Svg, limit: float, diameter: float, left: float, right: float, top: float) -> None:
    step = diameter if limit >= 2 * diameter else limit / 5
    for index in range(int(limit / step + 1e-9) + 1):
        x = left + (right - left) * index * step / limit
        svg.line(x, top, x, top - 5, stroke=palette.MUTED, stroke_width=1)
        svg.text(x, top - 10, f"{index * step / diameter:g} D", text_anchor="middle")
