"""Which surface lies under a point: what a start stands on that seems to stand in a wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray
from taskslam.world.world import World

_LEVEL = 0.9  # cosine of the slope that is still floor


@dataclass(frozen=True)
class SurfaceUnder:
    """height: z of the surface, m; model: whose it is."""

    height: float
    model: str


def surface_under(world: World, x: float, y: float, below: float) -> SurfaceUnder | None:
    """The highest level surface above z = 0 and below a height (m) over a point of the floor; None if there is none."""
    corners = world.collision.corners().astype(np.float64)
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    area = normal[:, 2]
    level = np.abs(area) > _LEVEL * np.linalg.norm(normal, axis=1)
    point = np.array([x, y])

    def side(p: FloatArray, q: FloatArray) -> FloatArray:
        along, aside = q[:, :2] - p[:, :2], point - p[:, :2]
        turned: FloatArray = along[:, 0] * aside[:, 1] - along[:, 1] * aside[:, 0]
        return turned

    weights = np.stack([side(b, c), side(c, a), side(a, b)], axis=1) * np.sign(area)[:, None]
    over = level & (weights >= 0.0).all(axis=1)
    if not over.any():
        return None
    shares = weights[over] / np.abs(area[over])[:, None]
    heights = np.einsum("tc,tc->t", shares, corners[over][:, :, 2])
    possible = np.flatnonzero((heights > 0.0) & (heights < below))
    if not len(possible):
        return None
    best = int(possible[np.argmax(heights[possible])])
    owner = int(world.collision.owner[np.flatnonzero(over)[best]])
    return SurfaceUnder(float(heights[best]), world.models[owner])
