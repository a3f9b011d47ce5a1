"""Precision against accuracy, one marker a method: filled if it reached every waypoint every time (protocol 5.3)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from taskslam.evaluation.metrics_file import Interval
from taskslam.report import palette
from taskslam.report.labels import LETTER_WIDTH, Place, place_labels
from taskslam.report.log_axis import CENTIMETRE, LogAxis, log_axis
from taskslam.report.markers import Style, draw_marker
from taskslam.report.svg import Svg

_SIZE = 380.0
_SHORTEST = 0.1  # of a value: an interval that reaches further down is cut at the edge of the figure
_FREE, _LETTERS = 8.0, 12.0  # around a mark; size of its name
_AWAY = (4.0, 12.0, 22.0, 34.0, 48.0)  # from a mark, where there is no room beside it
_LEFT, _TOP, _RIGHT, _BOTTOM = 50.0, 30.0, 50.0, 44.0


@dataclass(frozen=True)
class Errors:
    """What a scatter is of, in words. unit: what its numbers count, in metres or radians, and its sign."""

    of: str
    unit: float
    sign: str
    precision: str
    accuracy: str


POSITION = Errors("Precision against accuracy", CENTIMETRE, "cm", "E", "e")
HEADING = Errors("Precision against accuracy of the heading", math.radians(1.0), "°", "Δ", "δ")


@dataclass(frozen=True)
class Point:
    """Means of a method over its complete waypoints, in metres or radians. complete: its completeness is 100 %.

    accuracy_interval, precision_interval: 95 % intervals, drawn as thin lines.
    """

    name: str
    accuracy: float
    precision: float
    complete: bool
    style: Style
    accuracy_interval: Interval | None = None
    precision_interval: Interval | None = None


def scatter_axis(points: Sequence[Point], errors: Errors = POSITION) -> LogAxis:
    """One axis for both directions and for every panel that shows some of these points."""
    ends = [
        end
        for point in points
        for interval in (point.accuracy_interval, point.precision_interval)
        if interval is not None
        for end in (max(interval.low, _SHORTEST * point.precision), interval.high)
    ]
    return log_axis([*(value for point in points for value in (point.accuracy, point.precision)), *ends], errors.unit)


def scatter_figure(
    points: Sequence[Point], axis: LogAxis, diameter_m: float | None, label: str, errors: Errors = POSITION
) -> Markup:
    """Draw E upwards over e rightwards, with the line E = e, and second axes in robot diameters if there is one D.

    errors: headings have Δ and δ instead, and no D.
    """
    svg = Svg(_SIZE, _SIZE, label)
    side_w, side_h = _SIZE - _LEFT - _RIGHT, _SIZE - _TOP - _BOTTOM

    def x_of(metres: float) -> float:
        return _LEFT + axis.share(metres) * side_w

    def y_of(metres: float) -> float:
        return _TOP + (1 - axis.share(metres)) * side_h

    left, right, top, bottom = _LEFT, _LEFT + side_w, _TOP, _TOP + side_h
    with svg.group(font_size=12, fill=palette.MUTED):
        for tick in axis.ticks(errors.unit):
            x, y = x_of(tick * errors.unit), y_of(tick * errors.unit)
            svg.line(left, y, right, y, stroke=palette.HAIRLINE, stroke_width=1)
            svg.line(x, top, x, bottom, stroke=palette.HAIRLINE, stroke_width=1)
            svg.text(left - 8, y + 4, f"{tick:g}", text_anchor="end")
            svg.text(x, bottom + 18, f"{tick:g}", text_anchor="middle")
        for tick in axis.ticks(diameter_m, 5) if diameter_m else []:
            x, y = x_of(tick * diameter_m), y_of(tick * diameter_m)  # type: ignore[operator]
            svg.line(x, top, x, top - 5, stroke=palette.MUTED, stroke_width=1)
            svg.line(right, y, right + 5, y, stroke=palette.MUTED, stroke_width=1)
            svg.text(x, top - 10, f"{tick:g} D", text_anchor="middle")
            svg.text(right + 8, y + 4, f"{tick:g} D")
        svg.text((left + right) / 2, bottom + 38, f"accuracy {errors.accuracy}, {errors.sign}", text_anchor="middle")
        svg.text(13, (top + bottom) / 2, f"precision {errors.precision}, {errors.sign}", text_anchor="middle",
                 transform=f"rotate(-90 13 {(top + bottom) / 2:g})")  # fmt: skip
    svg.line(left, bottom, right, top, stroke=palette.FAILURE, stroke_width=1.4, stroke_dasharray="6 4")
    x, y = left + 0.2 * side_w, bottom - 0.2 * side_h
    turn = math.degrees(math.atan2(side_h, side_w))
    equal = f"{errors.precision} = {errors.accuracy}"
    svg.text(x, y - 6, equal, fill=palette.FAILURE, font_size=12, text_anchor="middle",
             class_="halo", transform=f"rotate(-{turn:.1f} {x:.1f} {y:.1f})")  # fmt: skip
    if not points:
        svg.text((left + right) / 2, (top + bottom) / 2, "no precision to show", fill=palette.MUTED, font_size=13,
                 text_anchor="middle", class_="halo")  # fmt: skip
    places = [(x_of(point.accuracy), y_of(point.precision)) for point in points]
    names = [point.name for point in points]
    labels = place_labels(places, names, _FREE, _LETTERS, (left, top, right, bottom), _AWAY)
    for point, mark, place in zip(points, places, labels, strict=True):
        if place is not None:  # else the legend must do
            _draw_label(svg, point, mark, place)
    # Hollow markers last: a filled one would hide them.
    for point, (x, y) in sorted(zip(points, places, strict=True), key=lambda pair: not pair[0].complete):
        with svg.group(data_method=point.style.key):
            svg.add("title", f"{point.name}: {_said(point.precision, errors.precision, errors)}, "
                             f"{_said(point.accuracy, errors.accuracy, errors)}")  # fmt: skip
            ink = {"stroke": point.style.colour, "stroke_width": 1.3, "stroke_opacity": 0.75}
            if point.precision_interval is not None:
                svg.line(x, y_of(point.precision_interval.low), x, y_of(point.precision_interval.high), **ink)
            if point.accuracy_interval is not None:
                svg.line(x_of(point.accuracy_interval.low), y, x_of(point.accuracy_interval.high), y, **ink)
            draw_marker(svg, point.style, x, y, 6.0, filled=point.complete)
    return svg.markup()


def _said(value: float, symbol: str, errors: Errors) -> str:
    return f"{symbol} {value / errors.unit:.2f} {errors.sign}"


def _draw_label(svg: Svg, point: Point, mark: Place, place: Place) -> None:
    """A name at its place, joined to its mark by a thin line where it does not stand beside it."""
    x, y = place
    width = LETTER_WIDTH * _LETTERS * len(point.name)
    near = (min(max(mark[0], x), x + width), min(max(mark[1], y - 0.8 * _LETTERS), y + 0.2 * _LETTERS))
    with svg.group(data_method=point.style.key):
        if math.dist(mark, near) > _FREE + 5:
            svg.line(*mark, *near, stroke=palette.MUTED, stroke_width=0.8)
        svg.text(*place, point.name, fill=palette.INK, font_size=_LETTERS, class_="halo")
