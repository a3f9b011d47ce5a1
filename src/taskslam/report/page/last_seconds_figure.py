"""Speed and estimation error over the seconds before a failure, one above the other on the same time axis."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from taskslam.geometry import FloatArray
from taskslam.report import palette
from taskslam.report.page.failure_story import Story
from taskslam.report.svg import Svg

_WIDTH, _PANEL, _GAP = 400.0, 62.0, 26.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 40.0, 12.0, 20.0, 34.0
_ROUND = (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)


def last_seconds_figure(story: Story, tolerance_m: float) -> Markup | None:
    """Draw both over the last seconds; None if neither is known. tolerance_m: of navigation, drawn into the error."""
    panels = [
        (f"{title}", values, colour, level)
        for title, values, colour, level in (
            ("true speed, m/s", story.speed, palette.TRUTH, None),
            ("distance from truth to estimate, m", story.error, palette.BELIEF, tolerance_m),
        )
        if np.isfinite(values).any()
    ]
    if not panels or len(story.times) < 2:
        return None
    height = _TOP + len(panels) * _PANEL + (len(panels) - 1) * _GAP + _BOTTOM
    svg = Svg(_WIDTH, height, f"Speed and estimation error over the last {-story.times[0]:.0f} s")
    scale = (_WIDTH - _LEFT - _RIGHT) / -float(story.times[0])
    xs = _WIDTH - _RIGHT + story.times * scale
    bottom = _TOP
    for index, (title, values, colour, level) in enumerate(panels):
        bottom = _TOP + index * (_PANEL + _GAP) + _PANEL
        _draw_panel(svg, title, xs, values, colour, level, bottom)
    _draw_seconds(svg, -float(story.times[0]), scale, bottom)
    return svg.markup()


def _draw_panel(
    svg: Svg, title: str, xs: FloatArray, values: FloatArray, colour: str, level: float | None, bottom: float
) -> None:
    most = max(float(np.nanmax(values)), (level or 0.0) * 1.2, 0.05)
    limit = next((number for number in _ROUND if number >= most), most)
    right = _WIDTH - _RIGHT
    with svg.group(font_size=12, fill=palette.MUTED):
        svg.text(_LEFT, bottom - _PANEL - 7, title)
        for share in (0.0, 1.0):
            y = bottom - share * _PANEL
            svg.line(_LEFT, y, right, y, stroke=palette.HAIRLINE, stroke_width=1)
            svg.text(_LEFT - 6, y + 4, f"{share * limit:g}", text_anchor="end")
        if level is not None:
            y = bottom - level / limit * _PANEL
            svg.line(_LEFT, y, right, y, stroke=palette.MUTED, stroke_width=1, stroke_dasharray="3 3")
            if level > 0.15 * limit:  # lower it would lie on the curve
                svg.text(_LEFT + 4, y - 4, "tolerance of navigation", font_size=11)
    known = np.flatnonzero(np.isfinite(values))
    for stretch in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1):
        points = np.column_stack([xs[stretch], bottom - values[stretch] / limit * _PANEL])
        if len(points) > 1:
            svg.polyline(points, stroke=colour, stroke_width=2, stroke_linejoin="round")


def _draw_seconds(svg: Svg, length: float, scale: float, bottom: float) -> None:
    step = next((step for step in (1, 2, 5, 10) if length / step <= 7), 10)
    right = _WIDTH - _RIGHT
    with svg.group(font_size=12, fill=palette.MUTED, text_anchor="middle"):
        for seconds in range(0, int(length + 1e-9) + 1, step):
            x = right - seconds * scale
            svg.line(x, bottom, x, bottom + 4, stroke=palette.MUTED, stroke_width=1)
            svg.text(x, bottom + 17, f"−{seconds}" if seconds else "0")
        svg.text((_LEFT + right) / 2, bottom + 31, "seconds before the failure")
