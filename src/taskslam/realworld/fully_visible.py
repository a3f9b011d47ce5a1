"""Is the whole tag in the picture? A detector also reports tags that the border cuts, with corners off by many pixels.

Measured: tags cut by up to 8 px are still reported, corners up to 13 px wrong. A margin of one cell, so that the white
around the tag is in view too, and a square that fits its corners to half a pixel, let none of them pass.
"""

from __future__ import annotations

import numpy as np

from taskslam.geometry import FloatArray
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.tags.tag_family import CELLS

MOST_RESIDUAL_PX = 0.5
LEAST_MARGIN_PX = 5.0


def border_margin(corners: FloatArray, camera: Camera) -> float:
    """How far (px) the outermost of some corners (P, 2) lies inside the image's edge; negative outside."""
    low = corners.min() + 0.5
    high = (np.array([camera.width, camera.height]) - 0.5 - corners).min()
    return float(min(low, high))


def needed_margin(corners: FloatArray, family: str) -> float:
    """The margin (px) that a tag with corners (4, 2) needs: one of its cells, or 5 px."""
    side = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).max())
    return max(LEAST_MARGIN_PX, side / CELLS[family])


def why_cut(corners: FloatArray, camera: Camera, family: str) -> str | None:
    """None for a tag (4, 2) that is wholly inside the image; else a sentence part that says by how much it is not."""
    margin, needed = border_margin(corners, camera), needed_margin(corners, family)
    if margin >= needed:
        return None
    return f"cut or nearly cut by the image's border ({margin:.1f} px inside, {needed:.1f} px needed)"
