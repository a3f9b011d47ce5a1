"""What recorded runs do over time: their errors on a logarithmic axis, or a coordinate on a plain one."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from markupsafe import Markup

from taskslam.geometry import FloatArray
from taskslam.report import palette
from taskslam.report.drawn_run import DrawnRun, Ground, Stretch
from taskslam.report.log_axis import log_axis
from taskslam.report.markers import Style
from taskslam.report.svg import Svg

_WIDTH, _HEIGHT = 520.0, 236.0
_LEFT, _TOP, _RIGHT, _BOTTOM = 54.0, 12.0, 12.0, 44.0
_MANY = 12
_LOWEST = 1e-3  # of the largest value: what is smaller is drawn here, so that one good moment does not squeeze the rest


def error_figure(
    on: Ground,
    runs: Sequence[DrawnRun],
    styles: Mapping[str, Style],
    label: str,
    values: Callable[[Stretch], FloatArray],
) -> Markup:
    """Draw errors of runs over time. values: of a stretch, in hundredths of what the label says."""
    every = np.concatenate([values(stretch) for run in runs for stretch in run.stretches])
    every = np.maximum(every, _LOWEST * float(every.max()))
    axis = log_axis([float(every.min()), float(every.max())])
    ticks = [(tick / 100, f"{tick:g}") for tick in axis.ticks(0.01, 7)]

    def share(value: FloatArray) -> FloatArray:
        inside = np.clip(value, axis.low, axis.high)
        return np.asarray(np.log(inside / axis.low) / math.log(axis.high / axis.low))

    return _figure(on, runs, styles, label, ticks, share, values, None)


def coordinate_figure(on: Ground, runs: Sequence[DrawnRun], styles: Mapping[str, Style]) -> Markup:
    """Draw the coordinate that the view along it hides, of runs and of the ground truth."""
    every = np.concatenate([on.third, *(stretch.third for run in runs for stretch in run.stretches)])
    low, high = float(every.min()), float(every.max())
    margin = 0.05 * max(high - low, 1e-3)
    low, high = low - margin, high + margin
    ticks = [(value, f"{value:g}") for value in _round_steps(low, high, 6)]
    return _figure(
        on, runs, styles, f"{'xyz'[on.axes[2]]}, m", ticks, lambda value: (value - low) / (high - low),
        lambda stretch: stretch.third, on.third,
    )  # fmt: skip


def _figure(
    on: Ground,
    runs: Sequence[DrawnRun],
    styles: Mapping[str, Style],
    label: str,
    ticks: Sequence[tuple[float, str]],
    share: Callable[[FloatArray], FloatArray],
    values: Callable[[Stretch], FloatArray],
    truth: FloatArray | None,
) -> Markup:
    svg = Svg(_WIDTH, _HEIGHT, f"{label} over time, {len(runs)} runs")
    right, bottom = _WIDTH - _RIGHT, _HEIGHT - _BOTTOM

    def points(times: FloatArray, of: FloatArray) -> FloatArray:
        x = _LEFT + times / max(on.duration_s, 1e-9) * (right - _LEFT)
        return np.column_stack([x, bottom - share(of) * (bottom - _TOP)])

    with svg.group(font_size=12, fill=palette.MUTED):
        for value, words in ticks:
            y = float(points(np.zeros(1), np.array([value]))[0, 1])
            svg.line(_LEFT, y, right, y, stroke=palette.HAIRLINE, stroke_width=1)
            svg.text(_LEFT - 8, y + 4, words, text_anchor="end")
        for second in _round_steps(0.0, on.duration_s, 8):
            x = _LEFT + second / max(on.duration_s, 1e-9) * (right - _LEFT)
            svg.line(x, bottom, x, bottom + 5, stroke=palette.MUTED, stroke_width=1)
            svg.text(x, bottom + 19, f"{second:g}", text_anchor="middle")
        svg.text((_LEFT + right) / 2, bottom + 38, "time, s", text_anchor="middle")
        middle = (_TOP + bottom) / 2
        svg.text(13, middle, label, text_anchor="middle", transform=f"rotate(-90 13 {middle:g})")
    for run in runs:
        style = styles[run.method]
        faint = 0.85 if len(runs) <= _MANY else 0.45
        with svg.group(data_method=style.key, stroke=style.colour, stroke_width=1.4, stroke_opacity=faint):
            svg.add("title", f"{run.method}: {run.file}")
            for stretch in run.stretches:
                svg.polyline(points(stretch.times, values(stretch)), stroke_linejoin="round")
    if truth is not None:
        svg.polyline(points(on.times, truth), stroke=palette.INK, stroke_width=1.1, stroke_dasharray="5 4")
    return svg.markup()


def _round_steps(low: float, high: float, most: int) -> list[float]:
    """Round numbers from low to high, at most so many and one."""
    if not high > low:
        return [low]
    raw = (high - low) / most
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(digit * power for digit in (1, 2, 5, 10) if digit * power >= raw * (1 - 1e-9))
    first = math.ceil(low / step - 1e-9)
    return [float(f"{step * count:.6g}") for count in range(first, math.floor(high / step + 1e-9) + 1)]
