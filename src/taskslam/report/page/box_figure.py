"""Strips beside a name: the box of a method's errors, and when a run had poses that match the ground truth."""

from __future__ import annotations

from markupsafe import Markup

from taskslam.geometry import FloatArray
from taskslam.report import palette
from taskslam.report.drawn_run import DrawnRun, Ground
from taskslam.report.log_axis import LogAxis
from taskslam.report.markers import Style
from taskslam.report.svg import Svg

_WIDTH, _HEIGHT, _TIME_HEIGHT = 1000.0, 26.0, 12.0
MOST_TICKS = 5
_STEADY = {"vector_effect": "non-scaling-stroke"}  # the strip is stretched, its lines are not


def box_strip(spread: FloatArray | None, axis: LogAxis, style: Style, name: str) -> Markup:
    """Draw the (5,) quantiles of `drawn_run.box` over an axis of the same unit; nothing but the grid for None."""
    svg = Svg(_WIDTH, _HEIGHT, f"Spread of the errors of {name}", kind="strip", stretched=True)
    for tick in axis.ticks(0.01, MOST_TICKS):
        x = axis.share(tick / 100) * _WIDTH
        svg.line(x, 0, x, _HEIGHT, stroke=palette.HAIRLINE, **_STEADY)
    if spread is not None:
        least, low, middle, high, most = (axis.share(value) * _WIDTH for value in spread.tolist())
        half = _HEIGHT / 2
        svg.line(least, half, most, half, stroke=style.colour, stroke_width=1.6, **_STEADY)
        for x in (least, most):
            svg.line(x, half - 5, x, half + 5, stroke=style.colour, stroke_width=1.6, **_STEADY)
        svg.add("rect", x=low, y=4, width=max(high - low, 1.0), height=_HEIGHT - 8, fill=palette.PAPER)
        svg.add("rect", x=low, y=4, width=max(high - low, 1.0), height=_HEIGHT - 8, fill=style.colour,
                fill_opacity=0.35, stroke=style.colour, stroke_width=1.4, **_STEADY)  # fmt: skip
        svg.line(middle, 4, middle, _HEIGHT - 4, stroke=palette.INK, stroke_width=2.2, **_STEADY)
    return svg.markup()


def time_strip(run: DrawnRun, on: Ground, style: Style) -> Markup:
    """Draw when a run had poses that match, over the time of the ground truth."""
    svg = Svg(_WIDTH, _TIME_HEIGHT, f"When {run.file} had poses: {len(run.stretches)} stretches", kind="strip",
              stretched=True)  # fmt: skip
    svg.add("rect", x=0, y=0, width=_WIDTH, height=_TIME_HEIGHT, fill=palette.TRACK)
    for stretch in run.stretches:
        begin, end = (min(max(at / max(on.duration_s, 1e-9), 0.0), 1.0) for at in (stretch.begin_s, stretch.end_s))
        svg.add("rect", x=begin * _WIDTH, y=0, width=max((end - begin) * _WIDTH, 3.0), height=_TIME_HEIGHT,
                fill=style.colour)  # fmt: skip
    return svg.markup()
