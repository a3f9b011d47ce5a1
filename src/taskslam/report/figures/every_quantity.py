"""Every quantity of the list in a panel of its own: a marker for each method and mode, with its 95 % interval.

What the tables say in numbers, for the eye; a quantity that a package adds has its panel too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from taskslam.report import palette
from taskslam.report.figures.lettering import fitting_names
from taskslam.report.figures.style import NORMAL, WIDTHS, Width, add_axes, marker_style, new_figure, printed
from taskslam.report.markers import Style

_ROW, _HEAD, _TICKS, _KEY, _GAP, _EDGE = 0.17, 0.26, 0.26, 0.22, 0.14, 0.08  # in
_NAMES, _PANEL = 1.05, 1.08  # in: room for names; the narrowest panel
_APART = 0.17  # of a row: how far the modes stand from its middle


@dataclass(frozen=True)
class Mark:
    """A value with the ends of its interval, as people write it; filled: with map."""

    value: float
    low: float | None
    high: float | None
    filled: bool


@dataclass(frozen=True)
class QuantityPanel:
    """A quantity. heading: symbol and unit; marks: of each method, in the order of the names."""

    heading: str
    marks: Sequence[Sequence[Mark]]


@printed
def quantity_figure(
    names: Sequence[str], styles: Sequence[Style], panels: Sequence[QuantityPanel], modes: Sequence[str], width: Width
) -> Figure:
    """Draw the panels side by side, as many as fit, in rows; methods from the most complete down.

    modes: words of those that were run, without map first.
    """
    across = max(1, int((WIDTHS[width] - _NAMES - _EDGE + _GAP) / (_PANEL + _GAP)))
    rows = math.ceil(len(panels) / across)
    inside, tall = (WIDTHS[width] - _NAMES - _EDGE + _GAP) / across - _GAP, _ROW * len(names)
    figure = new_figure(WIDTHS[width], _KEY + rows * (_HEAD + tall + _TICKS), constrained=False)
    texts = fitting_names(names, _NAMES - 0.2)
    for index, panel in enumerate(panels):
        down, right = divmod(index, across)
        left, top = _NAMES + right * (inside + _GAP), _KEY + down * (_HEAD + tall + _TICKS) + _HEAD
        axes = add_axes(figure, left, top, inside, tall)
        _draw_panel(axes, panel, styles)
        if right == 0:
            for row, (text, style) in enumerate(zip(texts, styles, strict=True)):
                across_axes = axes.get_yaxis_transform()
                axes.text(-0.06 / inside, row, text, transform=across_axes, ha="right", va="center_baseline",
                          color=style.colour, parse_math=False)  # fmt: skip
    _draw_key(figure, modes)
    return figure


def _draw_panel(axes: Axes, panel: QuantityPanel, styles: Sequence[Style]) -> None:
    axes.set_title(panel.heading, loc="left", fontsize=NORMAL, fontweight="bold", parse_math=False)
    axes.set_ylim(len(styles) - 0.5, -0.5)
    axes.set_yticks([])
    axes.grid(visible=True, axis="x", color=palette.HAIRLINE, linewidth=0.5)
    axes.spines[["top", "right", "left"]].set_visible(False)
    values = [mark.value for own in panel.marks for mark in own]
    if not values:
        axes.set_xticks([])
        axes.text(0.5, 0.5, "not defined", transform=axes.transAxes, ha="center", va="center", color=palette.MUTED)
        return
    low, high = min(0.0, *values), 1.15 * max(values, default=1.0)
    high = high if high > low else low + 1.0
    axes.set_xlim(low, high)
    ticks = [tick for tick in MaxNLocator(3, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high) if low <= tick <= high]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    for row, (own, style) in enumerate(zip(panel.marks, styles, strict=True)):
        axes.axhline(row, color=palette.HAIRLINE, linewidth=0.5, zorder=0)
        for mark in own:
            y = row + (_APART if mark.filled else -_APART)
            if mark.low is not None and mark.high is not None:
                axes.plot([mark.low, mark.high], [y, y], color=style.colour, linewidth=0.9, alpha=0.6, zorder=1)
            axes.plot(mark.value, y, zorder=2, **marker_style(style, mark.filled, 3.6))


def _draw_key(figure: Figure, modes: Sequence[str]) -> None:
    shape: dict[str, object] = {"color": palette.MUTED, "linestyle": "none", "marker": "o", "markersize": 3.6}
    filled = {"without map": "white", "with map": palette.MUTED}
    handles = [Line2D([], [], label=mode, markerfacecolor=filled[mode], **shape) for mode in modes]  # type: ignore[arg-type]
    handles.append(Line2D([], [], color=palette.MUTED, linewidth=0.9, label="95 % interval, cut at the panel"))
    height = figure.get_size_inches()[1]
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, 1 - 0.02 / height), ncols=len(handles),
                  handlelength=1.2, columnspacing=1.0, handletextpad=0.4, borderaxespad=0.2)  # fmt: skip
