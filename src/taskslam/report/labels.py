"""Names beside marks, placed where they hide nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

Box: TypeAlias = tuple[float, float, float, float]
Place: TypeAlias = tuple[float, float]

_DIRECTIONS = ((1, -1), (1, 1), (-1, -1), (-1, 1), (1, 0), (-1, 0), (0, -1), (0, 1))
LETTER_WIDTH = 0.59  # of the font's size
_ABOVE, _BELOW = 0.85, 0.25  # of the font's size: a line above and below its base


def place_labels(
    marks: Sequence[Place],
    texts: Sequence[str],
    radius: float,
    font_size: float,
    area: Box,
    away: Sequence[float] = (),
) -> list[Place | None]:
    """Where each text begins, its base line at y, or None where there is no room beside its mark.

    marks: middles of the marks, which keep `radius` around them free; area: left, top, right, bottom of the drawing;
    away: how far from the mark's edge a text may stand where there is no room beside it, in eight directions.
    """
    taken: list[Box] = [(x - radius, y - radius, x + radius, y + radius) for x, y in marks]
    places: list[Place | None] = []
    for (x, y), text in zip(marks, texts, strict=True):
        width, base = LETTER_WIDTH * font_size * len(text), y + 0.35 * font_size
        candidates = [
            (x + radius + 3, base),
            (x - radius - 3 - width, base),
            (x - width / 2, y + radius + _ABOVE * font_size),
            (x - width / 2, y - radius - _BELOW * font_size),
        ]
        for distance in away:
            middle_x, middle_y = radius + distance + width / 2, radius + distance + font_size / 2
            candidates += [(x + dx * middle_x - width / 2, base + dy * middle_y) for dx, dy in _DIRECTIONS]
        for place in candidates:
            box = _box(place, width, font_size)
            if _inside(box, area) and not any(_overlap(box, other) for other in taken):
                taken.append(box)
                places.append(place)
                break
        else:
            places.append(None)
    return places


def _box(place: Place, width: float, font_size: float) -> Box:
    x, y = place
    return (x, y - _ABOVE * font_size, x + width, y + _BELOW * font_size)


def _inside(box: Box, area: Box) -> bool:
    return box[0] >= area[0] and box[1] >= area[1] and box[2] <= area[2] and box[3] <= area[3]


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
