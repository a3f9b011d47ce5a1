"""Stand-ins for the materials that come with Gazebo (`Gazebo/Grey`, `Gazebo/Bricks` and so on).

Worlds name them, but their images belong to Gazebo. Colours are those that the names promise; brick, wood and the other
patterns are generated and repeat at a true size, so that a long wall shows bricks and not one stretched picture.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from taskslam.world.world import Material

Texture = npt.NDArray[np.uint8]

_COLOURS: dict[str, tuple[float, float, float]] = {
    "Black": (0.02, 0.02, 0.02),
    "FlatBlack": (0.1, 0.1, 0.1),
    "DarkGrey": (0.175, 0.175, 0.175),
    "DarkGray": (0.175, 0.175, 0.175),
    "Grey": (0.7, 0.7, 0.7),
    "Gray": (0.7, 0.7, 0.7),
    "LightGrey": (0.8, 0.8, 0.8),
    "White": (1.0, 1.0, 1.0),
    "WhiteGlow": (1.0, 1.0, 1.0),
    "Red": (1.0, 0.0, 0.0),
    "RedBright": (0.87, 0.26, 0.07),
    "DarkRed": (0.5, 0.0, 0.0),
    "Green": (0.0, 1.0, 0.0),
    "DarkGreen": (0.0, 0.5, 0.0),
    "Blue": (0.0, 0.0, 1.0),
    "DarkBlue": (0.0, 0.0, 0.5),
    "SkyBlue": (0.13, 0.44, 0.7),
    "Indigo": (0.33, 0.0, 0.5),
    "Purple": (1.0, 0.0, 1.0),
    "Turquoise": (0.0, 1.0, 1.0),
    "Yellow": (1.0, 1.0, 0.0),
    "DarkYellow": (0.7, 0.7, 0.0),
    "ZincYellow": (0.97, 0.95, 0.2),
    "Orange": (1.0, 0.51, 0.05),
    "DarkOrange": (0.55, 0.26, 0.05),
    "Gold": (0.8, 0.65, 0.12),
    "PaintedWall": (0.85, 0.83, 0.76),
    "Residential": (0.75, 0.68, 0.6),
}
_BRICK_TILE, _PLANK_TILE, _SPECKLE_TILE = 4.0, 1.6, 2.0


def stock_material(name: str) -> tuple[Material, float] | None:
    """Material for a stock name and the metres that one repeat of its texture covers (0 without a texture).

    None if the name is not one of Gazebo's.
    """
    if not name.startswith("Gazebo/"):
        return None
    short = name.removeprefix("Gazebo/")
    white = (1.0, 1.0, 1.0, 1.0)
    if short == "Bricks":
        return Material(name, white, _bricks()), _BRICK_TILE
    if short in ("Wood", "WoodFloor", "WoodPallet", "LightWood"):
        return Material(name, white, _planks()), _PLANK_TILE
    if short in ("Grass", "Road", "Asphalt", "Pioneer2Body", "CeilingTiled", "Motorway"):
        base = {"Grass": (86, 112, 58), "CeilingTiled": (208, 206, 198)}.get(short, (96, 96, 98))
        return Material(name, white, _speckle(base)), _SPECKLE_TILE
    r, g, b = _COLOURS.get(short.removesuffix("Transparent"), (0.7, 0.7, 0.7))
    return Material(name, (r, g, b, 0.5 if short.endswith("Transparent") else 1.0)), 0.0


def _smooth_noise(rng: np.random.Generator, size: int, cells_x: int, cells_y: int) -> npt.NDArray[np.float64]:
    """(size, size) periodic noise in -1..1: random values on a grid, interpolated by a smooth step."""
    grid = rng.uniform(-1.0, 1.0, (cells_y, cells_x))
    x, y = (np.arange(size) * cells / size for cells in (cells_x, cells_y))
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = x - x0, y - y0
    fx, fy = (fx * fx * (3 - 2 * fx))[None], (fy * fy * (3 - 2 * fy))[:, None]
    x1, y1 = (x0 + 1) % cells_x, (y0 + 1) % cells_y
    top = grid[np.ix_(y0, x0)] * (1 - fx) + grid[np.ix_(y0, x1)] * fx
    bottom = grid[np.ix_(y1, x0)] * (1 - fx) + grid[np.ix_(y1, x1)] * fx
    return np.asarray(top * (1 - fy) + bottom * fy)


@cache
def _bricks(size: int = 1024) -> Texture:
    """Running bond over 4 m x 4 m: 16 bricks of 25 cm by 48 courses of 8.3 cm, each of its own shade."""
    rng = np.random.Generator(np.random.PCG64(11))
    courses, bricks = 48, 16
    y = np.arange(size) * courses / size
    row = np.floor(y).astype(int)
    x = np.arange(size)[None] * bricks / size + 0.5 * (row[:, None] % 2)
    column = np.floor(x).astype(int) % bricks
    across = np.minimum(x % 1.0, 1.0 - x % 1.0) * 250.0
    along = np.minimum(y % 1.0, 1.0 - y % 1.0)[:, None] * 83.0
    edge = np.minimum(across, along) + 1.5 * _smooth_noise(rng, size, 128, 128)
    mortar = np.clip((7.0 - edge) / 2.5, 0.0, 1.0)[..., None]
    shade = rng.normal(1.0, 0.09, (courses, bricks))[row[:, None], column][..., None]
    warm = rng.uniform(-12.0, 12.0, (courses, bricks))[row[:, None], column]
    grain = 1.0 + 0.07 * _smooth_noise(rng, size, 256, 256) + 0.06 * _smooth_noise(rng, size, 32, 32)
    clay = np.stack([146.0 + warm, 86.0 + 0.5 * warm, np.full_like(warm, 70.0)], axis=-1) * shade * grain[..., None]
    joint = np.array([176.0, 170.0, 160.0]) * (1.0 + 0.06 * _smooth_noise(rng, size, 256, 256))[..., None]
    pixels: Texture = np.clip(clay * (1.0 - mortar) + joint * mortar, 0, 255).astype(np.uint8)
    return pixels


@cache
def _planks(size: int = 1024) -> Texture:
    """Eight planks of 20 cm with grain along them, over 1.6 m x 1.6 m."""
    rng = np.random.Generator(np.random.PCG64(12))
    planks = 8
    row = np.arange(size) * planks // size
    grain = 0.10 * _smooth_noise(rng, size, 6, 256) + 0.06 * _smooth_noise(rng, size, 24, 512)
    rings = 0.05 * np.sin(18.0 * _smooth_noise(rng, size, 4, 24))
    shade = rng.normal(1.0, 0.05, planks)[row][:, None]
    gap = np.minimum(np.arange(size) * planks / size % 1.0, 1.0 - np.arange(size) * planks / size % 1.0)[:, None]
    tone = (1.0 + grain + rings) * shade * np.where(gap < 0.012, 0.45, 1.0)
    pixels: Texture = np.clip(np.array([168.0, 122.0, 78.0]) * tone[..., None], 0, 255).astype(np.uint8)
    return pixels


@cache
def _speckle(base: tuple[int, int, int], size: int = 512) -> Texture:
    rng = np.random.Generator(np.random.PCG64(sum(base)))
    tone = 1.0 + 0.12 * _smooth_noise(rng, size, 256, 256) + 0.10 * _smooth_noise(rng, size, 16, 16)
    pixels: Texture = np.clip(np.array(base, dtype=np.float64) * tone[..., None], 0, 255).astype(np.uint8)
    return pixels
