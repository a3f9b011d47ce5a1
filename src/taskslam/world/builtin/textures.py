"""Surfaces of a home as tileable textures: wood, planks, tiles, bricks, plaster, wallpaper, fabric, stone.

Each function returns (size, size, 3) uint8 sRGB, is tileable in both directions, and shows structure from a few
millimetres to about a metre, so that feature trackers find corners at any distance.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.world.builtin.noise import Dice, Field, NoiseBank

Image = npt.NDArray[np.uint8]
Colour = tuple[int, int, int]

# directions without trigonometry: Pythagorean triples
_DIRECTIONS = [
    (1.0, 0.0),
    (0.0, 1.0),
    (0.6, 0.8),
    (0.8, 0.6),
    (-0.6, 0.8),
    (-0.8, 0.6),
    (5 / 13, 12 / 13),
    (-5 / 13, 12 / 13),
]


def paint(shade: Field, colour: Colour) -> Image:
    """Multiply a colour by a (H, W) shade (1 = the colour itself)."""
    bands = [np.clip(shade * np.float32(c), 0, 255).astype(np.uint8) for c in colour]
    return np.stack(bands, axis=-1)


def blend(low: Colour, high: Colour, weight: Field) -> Image:
    """Mix two colours by a (H, W) weight in 0..1."""
    bands = [
        np.clip(np.float32(a) + weight * np.float32(b - a), 0, 255).astype(np.uint8)
        for a, b in zip(low, high, strict=True)
    ]
    return np.stack(bands, axis=-1)


def plaster(bank: NoiseBank, dice: Dice, colour: Colour, size: int = 1024) -> Image:
    """Trowelled plaster: low contrast at every scale, with darker pits."""
    cloud, grain = bank.take("cloud", size, dice), bank.take("grain", size, dice)
    pits = bank.take("grain", size, dice) > np.float32(0.74)
    shade = np.float32(0.86) + cloud * np.float32(0.16) + grain * np.float32(0.10)
    shade[pits] *= np.float32(0.90)
    return paint(shade, colour)


def wood(bank: NoiseBank, dice: Dice, dark: Colour, light: Colour, size: int = 512) -> Image:
    """Sawn wood with its fibres along u."""
    fibre, cloud = bank.take("wood", size, dice), bank.take("cloud", size, dice)
    grain = bank.take("grain", size, dice)
    # growth rings: the fractional part of a bent height field
    bent = fibre * np.float32(5.0) + cloud * np.float32(2.0)
    ring = np.abs(bent - np.floor(bent) - np.float32(0.5)) * np.float32(2.0)
    return blend(dark, light, ring * np.float32(0.45) + fibre * np.float32(0.35) + grain * np.float32(0.25))


def planks(
    bank: NoiseBank, dice: Dice, dark: Colour, light: Colour, size: int = 1024, rows: int = 16, spread: float = 0.22
) -> Image:
    """A floor of planks along u, each cut from another place of the tree and with a tone of its own."""
    board = wood(bank, dice, dark, light, size)
    height = size // rows
    image = np.empty_like(board)
    for row in range(rows):
        band = slice(row * height, (row + 1) * height)
        cuts = sorted(dice.integer(0, size // 8) * 8 for _ in range(2))
        cuts = [cuts[0], max(cuts[1], cuts[0] + size // 4)]
        for start, end in ((cuts[0], cuts[1]), (cuts[1], cuts[0] + size)):
            columns = np.arange(start, end) % size
            from_row, from_column = dice.integer(0, size - height), dice.integer(0, size)
            piece = board[from_row : from_row + height][:, (columns + from_column) % size]
            tone = np.float32(dice.uniform(1.0 - spread, 1.0 + spread / 2))
            image[band, columns] = np.clip(piece * tone, 0, 255).astype(np.uint8)
            image[band, [start % size, (start + 1) % size]] = np.array(dark, np.uint8) // 2
        image[row * height : row * height + 2] = np.array(dark, np.uint8) // 2
    return image


def tiles(
    bank: NoiseBank,
    dice: Dice,
    colours: list[Colour],
    grout: Colour,
    size: int = 1024,
    count: int = 8,
    ornament: float = 0.0,
    spread: float = 0.18,
    wear: float = 0.22,
) -> Image:
    """Square tiles, each with its own tone (`spread`), under clouds (`wear`); a share `ornament` carries a drawing."""
    cloud, grain = bank.take("cloud", size, dice), bank.take("grain", size, dice)
    shade = np.float32(1.02 - wear) + cloud * np.float32(wear) + grain * np.float32(0.14)
    image = np.empty((size, size, 3), np.uint8)
    edge = size // count
    gap = max(2, size // 340)
    for i in range(count):
        for j in range(count):
            part = (slice(i * edge, (i + 1) * edge), slice(j * edge, (j + 1) * edge))
            tone = np.float32(dice.uniform(1.06 - spread, 1.06))
            image[part] = paint(shade[part] * tone, colours[(i + j) % len(colours)])
            if dice.uniform() < ornament:
                _ornament(image[part], dice, grout)
    _grooves(image, range(0, size, edge), range(0, size, edge), gap, paint(shade, grout))
    return image


def bricks(
    bank: NoiseBank, dice: Dice, colours: list[Colour], mortar: Colour, size: int = 1024, spread: float = 0.40
) -> Image:
    """Running bond, 32 courses and 10.67 : 1 in size, each brick with its own tone."""
    cloud, grain = bank.take("cloud", size, dice), bank.take("grain", size, dice)
    shade = np.float32(0.74) + cloud * np.float32(0.22) + grain * np.float32(0.26)
    joint = paint(shade, mortar)
    image = joint.copy()
    courses, per_course = 32, 10
    height, width = size // courses, size / per_course
    for row in range(courses):
        for column in range(per_course):
            start = round((column + 0.5 * (row % 2)) * width) + dice.integer(2, 5)
            columns = np.arange(start, start + round(width) - 6) % size
            rows = np.arange(row * height + 2, (row + 1) * height - 2)
            tone = np.float32(dice.uniform(1.12 - spread, 1.12))
            image[np.ix_(rows, columns)] = paint(shade[np.ix_(rows, columns)] * tone, dice.choice(colours))
    return image


def wallpaper(
    bank: NoiseBank, dice: Dice, ground: Colour, motif: list[Colour], size: int = 1024, count: int = 160
) -> Image:
    """Leaves and petals scattered without a raster on printed paper."""
    image = plaster(bank, dice, ground, size)
    for _ in range(count):
        colour = dice.choice(motif)
        length = dice.uniform(0.018, 0.055) * size
        direction = dice.choice(_DIRECTIONS)
        stamp_ellipse(image, dice.uniforms(2) * size, direction, length, length * dice.uniform(0.22, 0.5), colour, 0.75)
    return image


def fabric(bank: NoiseBank, dice: Dice, colour: Colour, size: int = 512, stripes: list[Colour] | None = None) -> Image:
    """Woven cloth: threads over and under, uneven dye, optional bands in both directions."""
    cloud, grain = bank.take("cloud", size, dice), bank.take("grain", size, dice)
    rows, columns = np.indices((size, size), dtype=np.int32)
    over = ((rows // 3 + columns // 3) % 2).astype(np.float32)
    shade = np.float32(0.62) + over * np.float32(0.14) + cloud * np.float32(0.28) + grain * np.float32(0.26)
    image = paint(shade, colour)
    for band in stripes or []:
        at, width = dice.integer(0, size), dice.integer(size // 32, size // 10)
        for axis in range(2):
            lines = (np.arange(at, at + width)) % size
            index = (lines, slice(None)) if axis == 0 else (slice(None), lines)
            image[index] = image[index] // 2 + paint(shade, band)[index] // 2
    return image


def stone(bank: NoiseBank, dice: Dice, dark: Colour, light: Colour, size: int = 512) -> Image:
    """Polished granite: flecks on a clouded ground."""
    cloud, grain, fleck = (bank.take(kind, size, dice) for kind in ("cloud", "grain", "grain"))
    image = blend(dark, light, cloud * np.float32(0.6) + grain * np.float32(0.4))
    image[fleck > np.float32(0.70)] //= 2
    image[fleck < np.float32(0.28)] = image[fleck < np.float32(0.28)] // 2 + 110
    return image


def enamel(bank: NoiseBank, dice: Dice, colour: Colour, size: int = 256) -> Image:
    """Painted or glazed surface with faint scuffs."""
    shade = np.float32(0.92) + bank.take("cloud", size, dice) * np.float32(0.08)
    shade += bank.take("grain", size, dice) * np.float32(0.05)
    return paint(shade, colour)


def stamp_ellipse(
    image: Image,
    centre: npt.NDArray[np.float64],
    direction: tuple[float, float],
    length: float,
    width: float,
    colour: Colour,
    opacity: float,
    wrap: bool = True,
) -> None:
    """Draw a filled ellipse (half axes in pixels) into `image`, wrapping at its borders if asked."""
    height, breadth = image.shape[:2]
    reach = int(max(length, width)) + 1
    row, column = int(centre[0]), int(centre[1])
    rows = np.arange(row - reach, row + reach + 1)
    columns = np.arange(column - reach, column + reach + 1)
    if not wrap:
        rows = rows[(rows >= 0) & (rows < height)]
        columns = columns[(columns >= 0) & (columns < breadth)]
    dy, dx = (rows - row)[:, None], (columns - column)[None, :]
    along = (dx * direction[0] + dy * direction[1]) / length
    across = (dy * direction[0] - dx * direction[1]) / width
    inside = along * along + across * across <= 1.0
    index = np.ix_(rows % height, columns % breadth)
    patch = image[index]
    mixed = patch * np.float32(1 - opacity) + np.array(colour, np.float32) * np.float32(opacity)
    image[index] = np.where(inside[:, :, None], mixed.astype(np.uint8), patch)


def _grooves(image: Image, rows: range, columns: range, gap: int, filling: Image) -> None:
    for k in range(gap):
        lines = np.array(rows) + k
        image[lines] = filling[lines]
        lines = np.array(columns) + k
        image[:, lines] = filling[:, lines]


def _ornament(tile: Image, dice: Dice, ink: Colour) -> None:
    """Draw a four-fold figure of random cells, as on cement tiles."""
    edge = tile.shape[0]
    cells = (dice.uniforms(4, 4) < 0.45).astype(np.uint8)
    quarter = cells | cells.T
    half = np.concatenate([quarter, quarter[::-1]])
    figure = np.concatenate([half, half[:, ::-1]], axis=1)
    at = np.arange(edge) * 8 // edge
    mask = figure[np.ix_(at, at)].astype(np.bool_)
    tile[mask] = tile[mask] // 3 + np.array(ink, np.uint8) // 3 * 2
