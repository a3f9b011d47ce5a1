"""Markers that tell methods apart where colour alone does not; filled or hollow by what the figure says."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from taskslam.report import palette
from taskslam.report.svg import Svg

# Corners of each shape, the angle of the first counter-clockwise from the right, and its size beside a circle's.
_SHAPES = ((0, 0.0, 1.0), (4, math.pi / 4, 1.3), (3, math.pi / 2, 1.35), (4, 0.0, 1.3), (3, -math.pi / 2, 1.35))


@dataclass(frozen=True)
class Style:
    """How a method is drawn on every figure. shape: index of its marker, 0 to 4."""

    colour: str
    shape: int


def method_styles(methods: list[str]) -> dict[str, Style]:
    """One style for each method name, in the order of first appearance; all differ up to sixty methods."""
    colours = palette.method_colours(methods)
    return {name: Style(colour, index % len(_SHAPES)) for index, (name, colour) in enumerate(colours.items())}


def draw_marker(svg: Svg, style: Style, x: float, y: float, radius: float = 6.0, filled: bool = True) -> None:
    """Draw a method's marker with its middle at (x, y)."""
    fill = style.colour if filled else "#ffffff"
    ink = {"fill": fill, "stroke": style.colour, "stroke_width": 2, "stroke_linejoin": "round"}
    corners, first, size = _SHAPES[style.shape]
    if corners == 0:
        svg.circle(x, y, radius, **ink)
        return
    angles = first + 2 * math.pi * np.arange(corners) / corners
    points = np.column_stack([x + radius * size * np.cos(angles), y - radius * size * np.sin(angles)])
    svg.polygon(points, **ink)


def marker_icon(style: Style, label: str, filled: bool = True) -> Markup:
    """A marker as a small drawing for running text."""
    svg = Svg(16, 16, label, kind="icon")
    draw_marker(svg, style, 8.0, 8.0, 4.6, filled)
    return svg.markup()
