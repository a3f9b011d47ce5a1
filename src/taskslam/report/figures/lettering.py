"""How wide words are on paper, and names made to fit."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

from taskslam.report.figures.style import FONT, SMALL
from taskslam.report.names import short_names

_SHORTEST = 4  # letters
_BOLD = 1.15  # times as wide
_EDGE = 0.03  # in


@lru_cache(maxsize=4096)
def text_width(text: str, size: float = SMALL) -> float:
    """Inches on paper of a line of text in so many points; nothing in it is taken for mathematics."""
    path = TextPath((0, 0), text.replace("$", r"\$"), size=size, prop=FontProperties(family=FONT))
    return float(path.get_extents().width) / 72 if len(path.vertices) else 0.0


def fitting_names(names: Sequence[str], inches: float) -> list[str]:
    """Names that fit into so many inches, the middle left out of longer ones; names that differ stay different."""
    for most in range(max((len(name) for name in names), default=0), _SHORTEST, -1):
        short = short_names(names, most)
        if all(text_width(name) <= inches for name in short):
            return short
    return short_names(names, _SHORTEST)


def draw_title(figure: Figure, title: str) -> None:
    """Write a figure's title at its top left, shortened to its width."""
    width, height = figure.get_size_inches()
    text = fitting_names([title], width / _BOLD - 2 * _EDGE)[0]
    figure.text(_EDGE / width, 1 - _EDGE / height, text, va="top", fontweight="bold", parse_math=False)
