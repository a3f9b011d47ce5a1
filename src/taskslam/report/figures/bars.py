"""Rows beside a figure, or below it, that are its legend too: a method's marker and name, and its shares as bars."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke

from taskslam.report import palette
from taskslam.report.figures.lettering import fitting_names
from taskslam.report.figures.style import NORMAL, add_axes, marker_style
from taskslam.report.markers import Style

_NAME, _BAR, _GAP = 0.115, 0.095, 0.045  # in: heights of a line with a name, of one with a bar, and below a row
_THICK = 0.055  # in
_HEAD = 0.17  # in: above the first row
_INDENT = 0.13  # in: right of a marker
_NUMBER = 0.33  # in: right of the bars
LIGHT, DARK = 0.35, 1.0  # how solid a bar is
_COLUMN, _GUTTER = 1.05, 0.12  # in: the least width of a column below a figure, and between two


@dataclass(frozen=True)
class Bar:
    """One bar. value: 0 to 1, or None if not defined; interval: of the value; text: what is written at its end."""

    value: float | None
    text: str
    interval: tuple[float, float] | None = None
    solid: float = DARK


@dataclass(frozen=True)
class Row:
    """One method. tag: its number on the figure, or nothing; filled: as its marker is."""

    name: str
    style: Style
    filled: bool
    bars: tuple[Bar, ...]
    tag: str = ""

    @property
    def height(self) -> float:
        """Inches on paper."""
        return _NAME + _BAR * len(self.bars) + _GAP


@dataclass(frozen=True)
class KeyLine:
    """What a marker means, below the rows. style: None for text alone."""

    text: str
    style: Style | None = None
    filled: bool = True


def rows_height(rows: Sequence[Row], key: Sequence[KeyLine] = ()) -> float:
    """Inches on paper of all rows with their heading, and of the key below."""
    return _HEAD + sum(row.height for row in rows) + (_GAP + _NAME * len(key) if key else 0.0)


def below_height(rows: Sequence[Row], key: Sequence[KeyLine], width: float) -> float:
    """Inches on paper of all rows in columns over so many inches, with the key in the last one."""
    return max(rows_height((), key), *(rows_height(own) for own in _in_columns(rows, width)))


def draw_rows_below(
    figure: Figure, left: float, top: float, width: float, rows: Sequence[Row], heading: str, key: Sequence[KeyLine]
) -> None:
    """Draw rows in columns from left to right, and the key in the last one."""
    columns = [*_in_columns(rows, width), ()]
    each = (width + _GUTTER) / len(columns)
    for index, own in enumerate(columns):
        last = index == len(columns) - 1
        draw_rows(figure, left + index * each, top, each - _GUTTER, own, "" if index else heading, key if last else ())


def _in_columns(rows: Sequence[Row], width: float) -> list[Sequence[Row]]:
    count = max(1, int((width + _GUTTER) / (_COLUMN + _GUTTER)) - 1)  # one is for the key
    size = math.ceil(len(rows) / count)
    return [rows[start : start + size] for start in range(0, len(rows), size)]


def draw_rows(
    figure: Figure,
    left: float,
    top: float,
    width: float,
    rows: Sequence[Row],
    heading: str,
    key: Sequence[KeyLine] = (),
) -> Axes:
    """Draw rows from top to bottom in a column of so many inches; a bar's full length is 1. Returns the column."""
    height = rows_height(rows, key)
    axes = add_axes(figure, left, top, width, height)
    axes.set_axis_off()
    axes.set_xlim(0, width)
    axes.set_ylim(height, 0)
    axes.text(0, 0.1, heading, fontsize=NORMAL)
    y, full = _HEAD, width - _NUMBER
    names = fitting_names([f"{row.tag} {row.name}".strip() for row in rows], width - _INDENT)
    for row, name in zip(rows, names, strict=True):
        middle = y + _NAME / 2
        axes.plot(0.045, middle, clip_on=False, **marker_style(row.style, row.filled))
        axes.text(_INDENT, middle, name, va="center_baseline", parse_math=False)
        for index, bar in enumerate(row.bars):
            _draw_bar(axes, bar, row.style.colour, y + _NAME + _BAR * (index + 0.5), full, width)
        y += row.height
    for line, middle in zip(key, (y + _GAP + _NAME * (index + 0.5) for index in range(len(key))), strict=True):
        if line.style is not None:
            axes.plot(0.045, middle, clip_on=False, **marker_style(line.style, line.filled, 3.6))
        axes.text(_INDENT if line.style else 0.0, middle, line.text, va="center_baseline", color=palette.MUTED)
    return axes


def _draw_bar(axes: Axes, bar: Bar, colour: str, middle: float, full: float, width: float) -> None:
    axes.add_patch(Rectangle((0, middle - _THICK / 2), full, _THICK, facecolor=palette.TRACK, linewidth=0))
    if bar.value is not None:
        length = bar.value * full
        axes.add_patch(
            Rectangle((0, middle - _THICK / 2), length, _THICK, facecolor=colour, alpha=bar.solid, linewidth=0)
        )
        if bar.interval is not None:
            ends = [end * full for end in bar.interval]
            axes.plot(ends, [middle] * 2, color=palette.INK, linewidth=0.6, marker="|", markersize=3.0,
                      markeredgewidth=0.6, solid_capstyle="butt",
                      path_effects=[withStroke(linewidth=1.4, foreground="white")])  # fmt: skip
    axes.text(width, middle, bar.text, va="center_baseline", ha="right")
