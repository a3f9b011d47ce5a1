"""Images that are seen once: paintings, rugs, rows of books, the view from a window, a screen."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.world.builtin.noise import Dice, NoiseBank, fractal_noise
from taskslam.world.builtin.textures import Colour, Image, blend, fabric, paint, stamp_ellipse

_PALETTES: list[list[Colour]] = [
    [(38, 70, 83), (42, 157, 143), (233, 196, 106), (244, 162, 97), (231, 111, 81)],
    [(29, 53, 87), (69, 123, 157), (168, 218, 220), (241, 250, 238), (230, 57, 70)],
    [(60, 42, 33), (178, 112, 62), (222, 184, 135), (247, 231, 206), (86, 107, 80)],
    [(45, 49, 66), (79, 93, 117), (191, 192, 192), (239, 131, 84), (250, 243, 224)],
    [(84, 44, 64), (150, 74, 84), (198, 122, 100), (224, 178, 132), (240, 226, 200)],
]
_BOOK_COLOURS: list[Colour] = [
    (122, 46, 40), (38, 62, 92), (52, 84, 60), (196, 170, 120), (88, 70, 54), (30, 30, 36),
    (160, 96, 44), (214, 206, 190), (70, 52, 92), (150, 58, 84), (40, 110, 120), (190, 140, 40),
]  # fmt: skip


def painting(bank: NoiseBank, dice: Dice, width: int = 256, height: int = 256) -> Image:
    """An abstract: washes, blots, bars and a few hard-edged discs."""
    palette = dice.choice(_PALETTES)
    wash = bank.take("cloud", 512, dice)[:height, :width]
    image = blend(dice.choice(palette), dice.choice(palette), wash)
    for _ in range(dice.integer(6, 12)):
        row, column = dice.integer(0, height), dice.integer(0, width)
        tall, wide = dice.integer(height // 16, height // 3), dice.integer(width // 16, width // 3)
        patch = image[row : row + tall, column : column + wide]
        texture = np.float32(0.8) + wash[row : row + tall, column : column + wide] * np.float32(0.3)
        patch[:] = paint(texture, dice.choice(palette))
    for _ in range(dice.integer(8, 18)):
        size = dice.uniform(0.03, 0.2) * min(width, height)
        centre = dice.uniforms(2) * (height, width)
        direction = dice.choice([(1.0, 0.0), (0.6, 0.8), (0.8, -0.6)])
        stretch = dice.uniform(0.2, 1.0)
        stamp_ellipse(image, centre, direction, size, size * stretch, dice.choice(palette), 0.9, wrap=False)
    return image


def rug(bank: NoiseBank, dice: Dice, width: int = 512, height: int = 512, detail: int = 24) -> Image:
    """A kilim: borders around a field that is mirrored both ways, woven."""
    palette = [_faded(colour) for colour in dice.choice(_PALETTES)]
    rows, columns = detail * height // max(width, height), detail * width // max(width, height)
    quarter = _kilim_quarter(dice, max(rows // 2, 4), max(columns // 2, 4), len(palette))
    half = np.concatenate([quarter, quarter[::-1]])
    field = np.concatenate([half, half[:, ::-1]], axis=1)
    at_row = np.arange(height) * field.shape[0] // height
    at_column = np.arange(width) * field.shape[1] // width
    image: Image = np.array(palette, np.uint8)[field[np.ix_(at_row, at_column)]]
    weave = fabric(bank, dice, (255, 255, 255), 1024)[:height, :width, :1].astype(np.float32) / np.float32(235.0)
    woven: Image = np.clip(image * weave, 0, 255).astype(np.uint8)
    return woven


def _faded(colour: Colour) -> Colour:
    """Return a colour as old wool shows it: two thirds of itself, one third warm grey."""
    red, green, blue = ((2 * c + g) // 3 for c, g in zip(colour, (168, 150, 128), strict=True))
    return (red, green, blue)


def _kilim_quarter(dice: Dice, rows: int, columns: int, colours: int) -> npt.NDArray[np.int64]:
    """Colour indices of one quarter: stepped diamonds from the centre, broken at random, inside two borders."""
    i, j = np.indices((rows, columns))
    ring = ((rows - 1 - i) + (columns - 1 - j)) // 2
    tones = np.array([dice.integer(0, colours) for _ in range(rows + columns)])
    field: npt.NDArray[np.int64] = tones[ring]
    broken = dice.uniforms(rows, columns) < 0.16
    field[broken] = (field[broken] + 1 + (i + j)[broken] % 2) % colours
    edge = np.minimum(i, j)
    field[edge == 0] = 0
    field[edge == 1] = (3 + (i + j)[edge == 1] % 2) % colours
    return field


def books(bank: NoiseBank, dice: Dice, width: int = 1024, height: int = 256) -> Image:
    """A row of spines of different width and height against the dark of the shelf, one metre wide."""
    image = np.full((height, width, 3), 26, np.uint8)
    grain = np.float32(0.78) + bank.take("grain", 1024, dice)[:height, :width] * np.float32(0.4)
    column = 0
    while column < width:
        thick = dice.integer(width // 50, width // 20)
        top = dice.integer(0, height // 4)
        book = (slice(top, height), slice(column, min(column + thick, width)))
        colour = dice.choice(_BOOK_COLOURS)
        image[book] = paint(grain[book], colour)
        _title(image[book], dice, colour)
        image[top:, column : column + 2] //= 3
        column += thick
    return image


def _title(spine: Image, dice: Dice, colour: Colour) -> None:
    """Print bands and letter-like marks on a spine."""
    tall, thick = spine.shape[:2]
    ink: Colour = (236, 220, 170) if sum(colour) < 380 else (40, 34, 30)
    for band in (dice.uniform(0.05, 0.15), dice.uniform(0.8, 0.92)):
        row = int(band * tall)
        spine[row : row + 4] = ink
    left, right = thick // 3, max(thick * 2 // 3, thick // 3 + 2)
    row, end = int(0.25 * tall), int(dice.uniform(0.5, 0.75) * tall)
    while row < end:
        length = dice.integer(3, 9)
        if dice.uniform() < 0.75:
            shift = dice.integer(-2, 3)
            spine[row : row + length, max(left + shift, 0) : right + shift] = ink
        row += length + 3


def window_view(bank: NoiseBank, dice: Dice, width: int = 512, height: int = 512) -> Image:
    """Sky with clouds over hills, hedges and a lawn."""
    clouds = bank.take("cloud", 512, dice)[:height, :width]
    up = np.linspace(1.0, 0.0, height, dtype=np.float32)[:, None]
    sky = np.clip(up * np.float32(0.5) + (clouds - np.float32(0.45)) * np.float32(-1.6), 0, 1)
    image = blend((240, 243, 246), (104, 158, 214), sky.astype(np.float32))
    leaves = bank.take("grain", 512, dice)[:height, :width]
    skyline = fractal_noise(dice, (1, width), (1, 5), 6)[0]
    rows = np.arange(height)[:, None]
    layers: list[tuple[float, float, Colour, Colour]] = [
        (0.40, 0.16, (96, 128, 120), (136, 160, 150)),
        (0.52, 0.20, (28, 58, 30), (96, 132, 66)),
        (0.78, 0.03, (70, 112, 46), (138, 170, 84)),
    ]
    for level, relief, dark, light in layers:
        ground = rows > (level + relief * (skyline - 0.5)) * height
        image[ground] = blend(dark, light, leaves)[ground]
        skyline = np.roll(skyline, width // 3)
    return image


def screen(dice: Dice, width: int = 256, height: int = 144) -> Image:
    """A switched-on display: a dark page with a few windows and lines of text."""
    image = np.full((height, width, 3), (24, 30, 44), np.uint8)
    for _ in range(4):
        row, column = dice.integer(4, height // 2), dice.integer(4, width * 2 // 3)
        tall, wide = dice.integer(height // 4, height // 2), dice.integer(width // 5, width // 3)
        pane = image[row : row + tall, column : column + wide]
        pane[:] = dice.choice([(230, 232, 236), (52, 66, 92), (190, 206, 220)])
        for line in range(4, pane.shape[0] - 4, 6):
            pane[line : line + 2, 4 : dice.integer(8, max(pane.shape[1], 9))] = dice.choice(
                [(60, 70, 90), (220, 120, 60)]
            )
    return image
