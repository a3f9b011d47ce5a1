"""Markers that tell methods apart where colour alone does not; filled or hollow by what the figure says.

The shape says which sensor a method sees with, so a reader compares LiDAR with cameras at a glance.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from taskslam.report import palette
from taskslam.report.svg import Svg
from taskslam.sensors import marker_family

# Corners of each shape (none: a circle), the angle of the first counter-clockwise from the right, its size beside a
# circle's, and for a star the radius of the corners between.
_SHAPES = (
    (0, 0.0, 1.0, 1.0),
    (4, math.pi / 4, 1.3, 1.0),
    (3, math.pi / 2, 1.35, 1.0),
    (4, 0.0, 1.3, 1.0),
    (3, -math.pi / 2, 1.35, 1.0),
    (5, math.pi / 2, 1.15, 1.0),
    (5, math.pi / 2, 1.5, 0.5),
)
CIRCLE, SQUARE, TRIANGLE, DIAMOND, TRIANGLE_DOWN, PENTAGON, STAR = range(7)
_SHAPES_OF_FAMILY = {
    "planar": (CIRCLE,),
    "spatial": (SQUARE, DIAMOND),
    "camera": (TRIANGLE, TRIANGLE_DOWN),
    "wheels": (PENTAGON,),
    "truth": (STAR,),
}
_ANY = (CIRCLE, SQUARE, TRIANGLE, DIAMOND, TRIANGLE_DOWN)


@dataclass(frozen=True)
class Style:
    """How a method is drawn on every figure. shape: index of its marker, 0 to 6; index: of the method."""

    colour: str
    shape: int
    index: int = 0

    @property
    def key(self) -> str:
        """What belongs to this method, as a word for a page's attributes."""
        return f"m{self.index}"


def method_styles(methods: list[str], sensors: Mapping[str, str] | None = None) -> dict[str, Style]:
    """One style for each method name, in the order of first appearance.

    sensors: the main sensor of a method (`cards.main_sensor`), which chooses its shape; without one, shapes take turns.
    Then the colour that was used least, so that the first twelve methods differ by colour alone, and up to twelve of
    one shape by both.
    """
    styles: dict[str, Style] = {}
    for index, name in enumerate(dict.fromkeys(methods)):
        family = _SHAPES_OF_FAMILY.get(marker_family((sensors or {}).get(name, "")))
        shapes = family or (_ANY[index % len(_ANY)],)
        pairs = Counter((style.colour, style.shape) for style in styles.values())
        colours = Counter(style.colour for style in styles.values())
        forms = Counter(style.shape for style in styles.values())
        colour, shape = min(
            ((colour, shape) for colour in palette.METHODS for shape in shapes),
            key=lambda pair: (pairs[pair], colours[pair[0]], forms[pair[1]]),
        )
        styles[name] = Style(colour, shape, index)
    return styles


def draw_marker(svg: Svg, style: Style, x: float, y: float, radius: float = 6.0, filled: bool = True) -> None:
    """Draw a method's marker with its middle at (x, y)."""
    fill = style.colour if filled else palette.PAPER
    ink = {"fill": fill, "stroke": style.colour, "stroke_width": 2, "stroke_linejoin": "round"}
    corners, first, size, between = _SHAPES[style.shape]
    if corners == 0:
        svg.circle(x, y, radius, **ink)
        return
    turns = 1 if between == 1.0 else 2
    angles = first + 2 * math.pi * np.arange(corners * turns) / (corners * turns)
    away = radius * size * np.where(np.arange(corners * turns) % turns, between, 1.0)
    points = np.column_stack([x + away * np.cos(angles), y - away * np.sin(angles)])
    svg.polygon(points, **ink)


def marker_icon(style: Style, label: str, filled: bool = True) -> Markup:
    """A marker as a small drawing for running text."""
    svg = Svg(16, 16, label, kind="icon")
    draw_marker(svg, style, 8.0, 8.0, 4.6, filled)
    return svg.markup()


def marker_shapes(styles: Iterable[Style]) -> Markup:
    """Every method's marker once, around (0, 0) and drawn nowhere: the page's script refers to it as `mark-KEY`."""
    svg = Svg(0, 0, "Markers", kind="shared")
    for style in styles:
        with svg.group(id=f"mark-{style.key}"):
            draw_marker(svg, style, 0.0, 0.0, 4.6)
    return svg.markup()
