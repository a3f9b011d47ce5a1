"""Precision against accuracy, one marker a method: filled if it reached every waypoint every time (protocol 5.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from taskslam.report import palette
from taskslam.report.log_axis import LogAxis, log_axis
from taskslam.report.markers import Style, draw_marker
from taskslam.report.svg import Svg

_SIZE = 400.0
_LEFT, _TOP, _RIGHT, _BOTTOM = 50.0, 30.0, 44.0, 44.0
_LETTER, _LINE = 6.6, 14.0  # the room that a letter of a label takes


@dataclass(frozen=True)
class Point:
    """Means of a method over its complete waypoints, in metres. complete: its completeness is 100 %."""

    name: str
    accuracy_m: float
    precision_m: float
    complete: bool
    style: Style


def scatter_axis(points: Sequence[Point]) -> LogAxis:
    """One axis for both directions and for every panel that shows some of these points."""
    return log_axis([value for point in points for value in (point.accuracy_m, point.precision_m)])


def scatter_figure(points: Sequence[Point], axis: LogAxis, diameter_m: float | None, label: str) -> Markup:
    """Draw E upwards over e rightwards, with the line E = e, and second axes in robot diameters if there is one D."""
    svg = Svg(_SIZE, _SIZE, label)
    side_w, side_h = _SIZE - _LEFT - _RIGHT, _SIZE - _TOP - _BOTTOM

    def x_of(metres: float) -> float:
        return _LEFT + axis.share(metres) * side_w

    def y_of(metres: float) -> float:
        return _TOP + (1 - axis.share(metres)) * side_h

    left, right, top, bottom = _LEFT, _LEFT + side_w, _TOP, _TOP + side_h
    with svg.group(font_size=12, fill=palette.MUTED):
        for tick in axis.ticks(0.01):
            x, y = x_of(tick / 100), y_of(tick / 100)
            svg.line(left, y, right, y, stroke=palette.HAIRLINE, stroke_width=1)
            svg.line(x, top, x, bottom, stroke=palette.HAIRLINE, stroke_width=1)
            svg.text(left - 8, y + 4, f"{tick:g}", text_anchor="end")
            svg.text(x, bottom + 18, f"{tick:g}", text_anchor="middle")
        for tick in axis.ticks(diameter_m) if diameter_m else []:
            x, y = x_of(tick * diameter_m), y_of(tick * diameter_m)  # type: ignore[operator]
            svg.line(x, top, x, top - 5, stroke=palette.MUTED, stroke_width=1)
            svg.line(right, y, right + 5, y, stroke=palette.MUTED, stroke_width=1)
            svg.text(x, top - 10, f"{tick:g} D", text_anchor="middle")
            svg.text(right + 8, y + 4, f"{tick:g} D")
        svg.text((left + right) / 2, bottom + 38, "accuracy e, cm", text_anchor="middle")
        svg.text(13, (top + bottom) / 2, "precision E, cm", text_anchor="middle",
                 transform=f"rotate(-90 13 {(top + bottom) / 2:g})")  # fmt: skip
    svg.line(left, bottom, right, top, stroke=palette.FAILURE, stroke_width=1.4, stroke_dasharray="6 4")
    svg.text(right - 6, top + 32, "E = e", fill=palette.FAILURE, font_size=12, text_anchor="end", class_="halo")
    places = [(x_of(point.accuracy_m), y_of(point.precision_m)) for point in points]
    _draw_labels(svg, points, places, right)
    for point, (x, y) in zip(points, places, strict=True):
        with svg.group():
            svg.add("title", f"{point.name}: E {point.precision_m * 100:.2f} cm, e {point.accuracy_m * 100:.2f} cm")
            draw_marker(svg, point.style, x, y, 6.0, filled=point.complete)
    return svg.markup()


def _draw_labels(svg: Svg, points: Sequence[Point], places: Sequence[tuple[float, float]], right: float) -> None:
    """Write each name beside its marker where it hides nothing; where there is no room the legend must do."""
    taken = [(x - 9, y - 9, x + 9, y + 9) for x, y in places]
    for point, (x, y) in zip(points, places, strict=True):
        width = _LETTER * len(point.name)
        for left, base in ((x + 11, y + 4), (x - 11 - width, y + 4), (x - width / 2, y + 22), (x - width / 2, y - 12)):
            box = (left, base - _LINE + 3, left + width, base + 3)
            inside = left > _LEFT + 2 and box[2] < right - 2
            if inside and not any(_overlap(box, other) for other in taken):
                svg.text(left, base, point.name, fill=palette.INK, font_size=12, class_="halo",
                         textLength=width, lengthAdjust="spacingAndGlyphs")  # fmt: skip
                taken.append(box)
                break


def _overlap(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
