"""The spread of E, or of e, over a method's complete waypoints: half violins, one for each mode (protocol 5.6).

A violin is a Gaussian kernel density cut at the smallest and the largest value; on a logarithmic axis, that of the
logarithm. Mean, median and quartiles are drawn and named for what they are, and every waypoint is a dot (protocol 7.3
#7).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from taskslam.mode import Mode
from taskslam.report import palette
from taskslam.report.figures.lettering import fitting_names
from taskslam.report.figures.scales import Measure, Scale, UnitSystem, scale_of, set_axis
from taskslam.report.figures.style import WIDTHS, Width, add_axes, marker_style, new_figure, printed
from taskslam.report.kernel_density import kernel_density
from taskslam.report.markers import Style

_ROW, _TOP, _BOTTOM, _EDGE = 0.27, 0.72, 0.36, 0.06  # in
_LEAST = 3  # values; fewer have no shape worth drawing
_POINTS = 80
_HALF = 0.42  # of a row
_LIGHT, _DARK = 0.28, 0.75
_MEAN: dict[str, object] = {"color": palette.INK, "linewidth": 1.3}
_MEDIAN: dict[str, object] = {"color": palette.INK, "linewidth": 0.9, "dashes": (2.2, 1.2)}
_QUARTILE: dict[str, object] = {"color": palette.INK, "linewidth": 0.8, "dashes": (0.8, 0.9)}


@dataclass(frozen=True)
class ViolinRow:
    """One method. complete: in every mode; completeness: `(C_wo | C_w)` in percent; values in the quantity's unit."""

    name: str
    style: Style
    complete: bool
    completeness: str
    without: tuple[float, ...]
    with_map: tuple[float, ...]


@printed
def violin_figure(
    rows: Sequence[ViolinRow],
    quantity: Measure,
    units: UnitSystem,
    what: str,
    width: Width,
    modes: Sequence[str],
    linear: bool = False,
) -> Figure:
    """Draw one row for each method, from the most complete down.

    what: such as `precision E`; modes: that were run; linear: from 0, always.
    """
    scale = scale_of([value for row in rows for value in (*row.without, *row.with_map)], linear=linear)
    names, shares = (1.12, 0.62) if width == "column" else (1.75, 0.72)
    height = _ROW * len(rows)
    figure = new_figure(WIDTHS[width], _TOP + height + _BOTTOM, constrained=False)
    axes = add_axes(figure, names, _TOP, WIDTHS[width] - names - shares - _EDGE, height)
    set_axis(axes, "x", scale, quantity, units, what)
    axes.grid(visible=True, axis="x", color=palette.HAIRLINE, linewidth=0.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks([])
    to_left = axes.get_yaxis_transform()
    inch = 1 / (WIDTHS[width] - names - shares - _EDGE)
    texts = fitting_names([row.name for row in rows], names - 0.26)
    for index, (row, text) in enumerate(zip(rows, texts, strict=True)):
        axes.axhline(index, color=palette.HAIRLINE, linewidth=0.5, zorder=0)
        _draw_half(axes, row.without, scale, row.style, index, up=True)
        _draw_half(axes, row.with_map, scale, row.style, index, up=False)
        axes.plot(
            -(names - 0.11) * inch, index, clip_on=False, transform=to_left, **marker_style(row.style, row.complete)
        )
        axes.text(-(names - 0.2) * inch, index, text, transform=to_left, va="center_baseline", parse_math=False)
        axes.text(1 + 0.06 * inch, index, row.completeness, transform=to_left, va="center_baseline")
    above = 1 + 0.2 / height  # of the ticks
    axes.text(1 + 0.06 * inch, above, "(C$_{w/o}$ | C$_{w/}$)\nin %", transform=axes.transAxes, va="bottom")
    boundary = next((index for index, row in enumerate(rows) if not row.complete), 0)
    if boundary:
        axes.axhline(boundary - 0.5, color=palette.FAILURE, linewidth=0.9, dashes=(5, 1.5, 1, 1.5))
    _draw_key(figure, modes)
    return figure


def _draw_half(axes: Axes, values: Sequence[float], scale: Scale, style: Style, row: int, up: bool) -> None:
    if not values:
        return
    sign = -1 if up else 1  # rows count downwards
    held = np.array([scale.held(value) for value in values])
    at = np.log(held) if scale.log else held
    outline = None
    if len(at) >= _LEAST and np.ptp(at) > 1e-9:
        x = np.linspace(at.min(), at.max(), _POINTS)
        density = kernel_density(at, x)
        outline = np.exp(x) if scale.log else x, _HALF * density / density.max()
        axes.fill_between(outline[0], row, row + sign * outline[1], facecolor=style.colour,
                          alpha=_LIGHT if up else _DARK, linewidth=0)  # fmt: skip
        axes.plot(outline[0], row + sign * outline[1], color=style.colour, linewidth=0.8)

    def line(value: float, ink: dict[str, object], whole: bool = False) -> None:
        height = _HALF if whole or outline is None else float(np.interp(value, *outline))
        axes.plot([value, value], [row, row + sign * height], solid_capstyle="butt", **ink)  # type: ignore[arg-type]

    low, middle, high = np.quantile(held, (0.25, 0.5, 0.75)).tolist()
    if outline is not None:
        line(low, _QUARTILE)
        line(high, _QUARTILE)
        line(middle, _MEDIAN)
    line(scale.held(float(np.mean(values))), _MEAN, whole=True)
    axes.plot(held, np.full(len(held), row + sign * 0.09), linestyle="none", marker="o", markersize=1.3,
              markerfacecolor=palette.INK, markeredgewidth=0)  # fmt: skip


def _draw_key(figure: Figure, modes: Sequence[str]) -> None:
    """What lines, dots and shades mean, above the rows."""
    halves = {
        Mode.WITHOUT_MAP.value: Patch(facecolor=palette.MUTED, alpha=_LIGHT, label="above: without map"),
        Mode.WITH_MAP.value: Patch(facecolor=palette.MUTED, alpha=_DARK, label="below: with map"),
    }
    lines = [
        Line2D([], [], label="mean", **_MEAN),  # type: ignore[arg-type]
        Line2D([], [], label="median", **_MEDIAN),  # type: ignore[arg-type]
        Line2D([], [], label="quartiles", **_QUARTILE),  # type: ignore[arg-type]
    ]
    height = figure.get_size_inches()[1]
    for top, handles in ((0.02, [halves[mode] for mode in modes]), (0.16, lines)):
        figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, 1 - top / height), ncols=len(handles),
                      handlelength=1.5, columnspacing=1.2, handletextpad=0.5, borderaxespad=0.2)  # fmt: skip
