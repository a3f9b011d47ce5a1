"""The room of the conformance drive: boxes on a floor, and what rays meet in it.

8 m x 6 m and 2.6 m high, an island in the middle, and boxes of different heights along the walls that make every corner
look different. Cupboards hang on the walls: a 3D LiDAR whose rings fell on bare walls and floor alone would see rings
that move with it. A planar ray meets everything that stands on the floor, whatever its height, and nothing that hangs.
"""

from __future__ import annotations

import numpy as np

from taskslam.geometry import FloatArray

# x0, y0, x1, y1 and height in metres: the room itself, the island, and the boxes along the walls.
STANDING = (
    (-4.0, -3.0, 4.0, 3.0, 2.6),
    (-1.2, -0.5, 1.0, 0.5, 0.9),
    (-4.0, 1.8, -2.9, 3.0, 1.8),
    (3.2, -3.0, 4.0, -1.6, 0.7),
    (1.5, 2.5, 2.7, 3.0, 1.1),
    (-3.2, -3.0, -2.4, -2.6, 1.4),
    (3.6, 0.4, 4.0, 1.5, 0.6),
)
# x0, y0, x1, y1, bottom and top in metres: cupboards on the walls, and what stands on the island.
HANGING = (
    (-2.0, -3.0, -1.4, -2.65, 0.5, 1.0),
    (-0.9, -3.0, -0.6, -2.75, 0.3, 0.7),
    (0.1, -3.0, 0.9, -2.6, 0.55, 1.3),
    (1.6, -3.0, 2.0, -2.7, 0.35, 0.6),
    (2.3, -3.0, 2.9, -2.55, 0.7, 1.2),
    (3.65, -1.3, 4.0, -0.6, 0.5, 0.9),
    (3.55, -0.3, 4.0, 0.1, 0.6, 1.4),
    (3.7, 1.9, 4.0, 2.6, 0.4, 0.8),
    (0.4, 2.6, 1.1, 3.0, 0.5, 0.9),
    (-0.6, 2.7, -0.2, 3.0, 0.3, 1.2),
    (-1.9, 2.55, -1.1, 3.0, 0.6, 1.0),
    (-2.6, 2.7, -2.3, 3.0, 0.4, 0.8),
    (-4.0, 0.7, -3.6, 1.3, 0.45, 1.1),
    (-4.0, -0.5, -3.7, 0.1, 0.3, 0.7),
    (-4.0, -1.7, -3.55, -0.9, 0.6, 1.3),
    (-4.0, -2.5, -3.7, -2.1, 0.4, 0.9),
    (-1.0, -0.3, -0.5, 0.2, 0.9, 1.3),
    (0.3, -0.1, 0.7, 0.4, 0.9, 1.1),
)


def _segments() -> FloatArray:
    """(S, 4) wall pieces as start x, y and direction x, y."""
    pieces = []
    for x0, y0, x1, y1, _ in STANDING:
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        for (xa, ya), (xb, yb) in zip(corners, corners[1:] + corners[:1], strict=True):
            pieces.append((xa, ya, xb - xa, yb - ya))
    return np.array(pieces)


_SEGMENTS = _segments()


def planar_distances(laser: FloatArray, angles: FloatArray) -> FloatArray:
    """(N,) distances of N level rays, each from its own (x, y, theta), to the nearest wall.

    Ray o + t d meets segment p + u e where t = (p - o) x e / (d x e) and u = (p - o) x d / (d x e), 0 <= u <= 1.
    """
    heading = laser[:, 2] + angles
    dx, dy = np.cos(heading)[:, None], np.sin(heading)[:, None]
    px, py = _SEGMENTS[:, 0] - laser[:, :1], _SEGMENTS[:, 1] - laser[:, 1:2]
    ex, ey = _SEGMENTS[:, 2], _SEGMENTS[:, 3]
    cross = dx * ey - dy * ex
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (px * ey - py * ex) / cross
        u = (px * dy - py * dx) / cross
    distance: FloatArray = np.where((t > 0) & (u >= 0) & (u <= 1), t, np.inf).min(axis=1)
    return distance


def spatial_distances(origins: FloatArray, directions: FloatArray) -> FloatArray:
    """(N,) distances from (N, 3) origins in the open along (N, 3) unit directions to the nearest surface.

    The slabs of Kay and Kajiya (1986): a ray is in a box from the last entry into to the first exit out of its slabs.
    The room is left, the boxes in it are entered.
    """
    with np.errstate(divide="ignore"):
        inverse = 1.0 / directions
    distance = np.full(len(origins), np.inf)
    boxes = [(x0, y0, x1, y1, 0.0, height) for x0, y0, x1, y1, height in STANDING]
    for index, (x0, y0, x1, y1, bottom, top) in enumerate([*boxes, *HANGING]):
        low, high = np.array([x0, y0, bottom]), np.array([x1, y1, top])
        with np.errstate(invalid="ignore"):  # 0 * inf: a ray within the plane of a face
            one, two = (low - origins) * inverse, (high - origins) * inverse
        enters, leaves = np.fmin(one, two).max(axis=1), np.fmax(one, two).min(axis=1)
        hits = leaves if index == 0 else np.where((enters > 0) & (enters <= leaves), enters, np.inf)
        distance = np.fmin(distance, hits)
    return distance
