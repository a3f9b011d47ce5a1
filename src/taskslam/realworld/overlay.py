"""The picture of an arrival as kept for the report: the part around the tag, in grey, with the measured pose drawn."""

from __future__ import annotations

import io

import numpy as np

from taskslam.geometry import FloatArray
from taskslam.realworld.cameras.images import read_grey
from taskslam.realworld.looks import Look

SIDE = 360
"""px of the longer side of a kept picture."""

_AROUND = 2.2  # tag sides shown on each side
_SEEN, _WRONG = (90, 220, 60), (255, 90, 60)
_HEADING = (255, 0, 220)


def picture(look: Look, good: bool) -> bytes:
    """JPEG of the part of an image around its tags, outlined, an arrow to the top of each; the whole image without one.

    Raises:
        InputError: the image is broken.
    """
    from PIL import Image, ImageDraw

    grey = read_grey(look.frame.path)
    corners = [tag.corners for tag in look.tags]
    box = _box(corners, grey.shape)
    part = Image.fromarray(grey).crop(box).convert("RGB")
    scale = SIDE / max(part.size)
    part = part.resize(
        (max(1, round(part.width * scale)), max(1, round(part.height * scale))), Image.Resampling.LANCZOS
    )
    draw = ImageDraw.Draw(part)
    for at in corners:
        drawn = (at + 0.5 - box[:2]) * scale
        draw.polygon([tuple(point) for point in drawn.tolist()], outline=_SEEN if good else _WRONG, width=2)
        _arrow(draw, drawn)
    content = io.BytesIO()
    part.save(content, "JPEG", quality=82)
    return content.getvalue()


def _arrow(draw: object, corners: FloatArray) -> None:
    from PIL import ImageDraw

    assert isinstance(draw, ImageDraw.ImageDraw)
    middle, top = corners.mean(axis=0), corners[:2].mean(axis=0)
    tip = middle + 1.7 * (top - middle)
    along = (tip - middle) / max(float(np.linalg.norm(tip - middle)), 1e-9)
    aside = np.array([-along[1], along[0]])
    draw.line([tuple(middle.tolist()), tuple((tip - 9 * along).tolist())], fill=_HEADING, width=3)
    head = np.array([tip, tip - 16 * along + 8 * aside, tip - 16 * along - 8 * aside])
    draw.polygon([tuple(point) for point in head.tolist()], fill=_HEADING)


def _box(corners: list[FloatArray], shape: tuple[int, ...]) -> tuple[int, int, int, int]:
    """Left, top, right, bottom (px) of what is shown: 4 to 3, inside the image."""
    height, width = shape
    if not corners:
        return 0, 0, width, height
    points = np.concatenate(corners)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    side = max(float(np.ptp(at, axis=0).max()) for at in corners)
    half_height = max(float(np.ptp(points, axis=0).max()) / 2 + _AROUND * side, 60.0)
    half = np.array([min(half_height * 4 / 3, width / 2), min(half_height, height / 2)])
    low = np.clip(middle - half, 0, np.array([width, height]) - 2 * half)
    left, top = np.floor(low).astype(int).tolist()
    right, bottom = np.ceil(low + 2 * half).astype(int).tolist()
    return left, top, min(right, width), min(bottom, height)
