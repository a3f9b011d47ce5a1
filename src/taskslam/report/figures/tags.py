"""Short texts beside markers, placed where they hide neither a marker nor one another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from taskslam.report import palette
from taskslam.report.figures.style import SMALL
from taskslam.report.labels import place_labels

_RADIUS = 3.0  # pt around a marker's middle
_AWAY = (2.0, 6.0, 10.0, 15.0, 21.0, 28.0)  # pt
_LEADER = 5.0  # pt: a text further than this from its marker gets a line to it


def add_tags(axes: Axes, tags: Sequence[tuple[tuple[float, float], str]]) -> None:
    """Write each text beside its place in data coordinates; an empty text only keeps its place free.

    Call it last: it fixes the layout of the figure, for places on paper must be known.
    """
    figure = axes.get_figure(root=True)
    if figure is None or not any(text for _, text in tags):
        return
    figure.draw_without_rendering()
    to_points = 72.0 / figure.dpi
    box = axes.get_window_extent()
    # Down is positive where labels are placed.
    marks = np.array([axes.transData.transform(place) for place, _ in tags]) * to_points * [1, -1]
    area = (box.x0 * to_points, -box.y1 * to_points, box.x1 * to_points, -box.y0 * to_points)
    texts = [text for _, text in tags]
    places = place_labels([(float(x), float(y)) for x, y in marks], texts, _RADIUS, SMALL, area, _AWAY)
    for (at, text), (x, y), place in zip(tags, marks, places, strict=True):
        if place is None or not text:  # no room: the legend must do
            continue
        left, base = place[0] - x, y - place[1]
        far = max(abs(left + 0.3 * SMALL * len(text)), abs(base + 0.35 * SMALL)) > _RADIUS + _LEADER + 0.5 * SMALL
        arrow = (
            {"arrowstyle": "-", "linewidth": 0.4, "color": palette.MUTED, "shrinkA": 0, "shrinkB": 2} if far else None
        )
        annotation = axes.annotate(
            text, at, (left, base), textcoords="offset points", fontsize=SMALL, arrowprops=arrow,
            path_effects=[withStroke(linewidth=1.5, foreground="white")], zorder=4,
        )  # fmt: skip
        annotation.set_in_layout(False)
