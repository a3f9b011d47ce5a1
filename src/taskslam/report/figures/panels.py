"""Panels of a figure with the rows of its methods beside them, or below where the rows are many."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from taskslam.report.figures.bars import KeyLine, Row, below_height, draw_rows, draw_rows_below, rows_height
from taskslam.report.figures.style import WIDTHS, Width, add_axes, new_figure

_LEGEND = {"column": 1.14, "page": 1.55}  # in: of the rows beside the panels
_TOP, _BOTTOM = 0.36, 0.36  # in: above and below a panel, for its ticks and labels
_HEAD, _EDGE = 0.08, 0.1  # in: above the rows, and at the edge of the paper
_TOO_LONG = 1.5  # times the height of the panels: rows that would be longer beside them stand below


@dataclass(frozen=True)
class Legend:
    """What explains the panels: a row for each method, and the key of their markers."""

    rows: Sequence[Row]
    heading: str
    key: Sequence[KeyLine]


def figure_with_panels(
    count: int,
    legend: Legend,
    width: Width,
    sides: tuple[float, float],
    height: Callable[[float, float], float],
) -> tuple[Figure, list[Axes]]:
    """A figure with so many empty panels and its legend; panels stand side by side on a page, else above one another.

    sides: inches left and right of each panel, for its ticks and labels; height: of a panel in inches, from its width
    and the height that the rows beside it leave it (0 with the rows below).
    """
    across = 1 if width == "column" else count
    down = count // across
    left, right = sides
    beside = rows_height(legend.rows, legend.key) + _HEAD + _EDGE
    cell = (WIDTHS[width] - _LEGEND[width] - _EDGE) / across
    panel = cell - left - right
    tall = height(panel, beside / down - _TOP - _BOTTOM)
    below = beside > _TOO_LONG * down * (_TOP + tall + _BOTTOM)
    if below:
        cell += _LEGEND[width] / across
        panel = cell - left - right
        tall = height(panel, 0.0)
    panels = down * (_TOP + tall + _BOTTOM)
    inner = WIDTHS[width] - 2 * _EDGE
    total = panels + below_height(legend.rows, legend.key, inner) + _EDGE if below else max(panels, beside)
    figure = new_figure(WIDTHS[width], total, constrained=False)
    axes = [
        add_axes(figure, left + index % across * cell, _TOP + index // across * (_TOP + tall + _BOTTOM), panel, tall)
        for index in range(count)
    ]
    if below:
        draw_rows_below(figure, _EDGE, panels, inner, legend.rows, legend.heading, legend.key)
    else:
        edge = across * cell + _EDGE / 2
        draw_rows(figure, edge, _HEAD, _LEGEND[width] - _EDGE / 2, legend.rows, legend.heading, legend.key)
    return figure, axes
