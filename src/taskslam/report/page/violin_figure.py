"""Half violins of E: a Gaussian kernel density, cut at the data, with mean and quartiles (protocol 5.6).

Drawn on a logarithmic axis, so the density is that of log E. Without map above the line, with map below.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from taskslam.mode import Mode
from taskslam.report import palette
from taskslam.report.kernel_density import kernel_density
from taskslam.report.log_axis import FLOOR, LogAxis
from taskslam.report.svg import Svg

_WIDTH, _HALF = 1000.0, 30.0
_LEAST = 3  # values; fewer have no shape worth drawing
_POINTS = 60
MOST_TICKS = 11
_STEADY = {"vector_effect": "non-scaling-stroke"}  # the strip is stretched, its lines are not


def violin_strip(without: Sequence[float], with_map: Sequence[float], axis: LogAxis, colour: str, name: str) -> Markup:
    """Draw both halves of one method over an axis in metres; it may be stretched to any width."""
    svg = Svg(_WIDTH, 2 * _HALF, f"Spread of E over the waypoints of {name}", kind="strip", stretched=True)
    for tick in axis.ticks(0.01, MOST_TICKS):
        x = axis.share(tick / 100) * _WIDTH
        svg.line(x, 0, x, 2 * _HALF, stroke=palette.HAIRLINE, **_STEADY)
    svg.line(0, _HALF, _WIDTH, _HALF, stroke=palette.HAIRLINE, **_STEADY)
    with svg.group(data_mode=Mode.WITHOUT_MAP):
        _draw_half(svg, without, axis, colour, up=True)
    with svg.group(data_mode=Mode.WITH_MAP):
        _draw_half(svg, with_map, axis, colour, up=False)
    return svg.markup()


def _draw_half(svg: Svg, values: Sequence[float], axis: LogAxis, colour: str, up: bool) -> None:
    if not values:
        return
    tip = 1.0 if up else 2 * _HALF - 1.0
    logs = np.log(np.maximum(np.asarray(values, dtype=np.float64), FLOOR))
    if len(logs) >= _LEAST and np.ptp(logs) > 1e-9:
        at = np.linspace(logs.min(), logs.max(), _POINTS)
        density = kernel_density(logs, at)
        x = np.array([axis.share(value) for value in np.exp(at)]) * _WIDTH
        y = _HALF + (tip - _HALF) * density / density.max()
        outline = np.column_stack([[x[0], *x, x[-1]], [_HALF, *y, _HALF]])
        dash = {"stroke_dasharray": "4 3"} if up else {}
        svg.polygon(outline, fill=colour, fill_opacity=0.2 if up else 0.45, stroke=colour, stroke_width=1.4,
                    **dash, **_STEADY)  # fmt: skip
    else:
        for value in values:
            x_at = axis.share(value) * _WIDTH
            svg.line(x_at, _HALF, x_at, tip, stroke=colour, stroke_width=2, **_STEADY)
    low, middle, high = np.quantile(values, (0.25, 0.5, 0.75)).tolist()
    mean = float(np.mean(values))
    for value, width, pattern in ((low, 1.2, "2 2"), (middle, 1.6, "6 3"), (high, 1.2, "2 2"), (mean, 2.4, "")):
        x_at = axis.share(value) * _WIDTH
        dash = {"stroke_dasharray": pattern} if pattern else {}
        svg.line(x_at, _HALF, x_at, tip, stroke=palette.INK, stroke_width=width, **dash, **_STEADY)
