"""Images of workplaces that are seen once or a few times: signs, labels, boards, cartons, shutters, monitors."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.world.builtin.noise import Dice, NoiseBank
from taskslam.world.builtin.textures import Colour, Image, paint

# each character is five rows of three cells, one octal digit a row, the first row first
_GLYPHS = {
    "0": "75557", "1": "26227", "2": "71747", "3": "71717", "4": "55711",
    "5": "74717", "6": "74757", "7": "71122", "8": "75757", "9": "75717",
    "A": "25755", "B": "65656", "C": "74447", "D": "65556", "E": "74647", "F": "74644",
    "H": "55755", "I": "72227", "L": "44447", "N": "57775", "O": "75557", "P": "75744",
    "R": "65655", "S": "74717", "T": "72222", "U": "55557", "W": "55775", "X": "55255", "+": "02720", " ": "00000",
}  # fmt: skip
_PAPER: list[Colour] = [(248, 246, 240), (250, 240, 150), (190, 222, 244), (246, 196, 200), (206, 234, 200)]
_INK: list[Colour] = [(50, 54, 64), (30, 70, 140), (170, 40, 40), (30, 110, 70)]


def sign(text: str, ground: Colour, ink: Colour, cell: int = 16) -> Image:
    """A line of large characters within a margin of one cell; each is three cells wide and five high."""
    rows, columns = 7, 4 * len(text) + 1
    mask = np.zeros((rows, columns), np.bool_)
    for k, character in enumerate(text):
        for row, octal in enumerate(_GLYPHS[character]):
            for bit in range(3):
                mask[row + 1, 4 * k + 1 + bit] = bool(int(octal, 8) & (4 >> bit))
    big = mask.repeat(cell, axis=0).repeat(cell, axis=1)
    image: Image = np.where(big[:, :, None], np.array(ink, np.uint8), np.array(ground, np.uint8))
    return image


def hazard(bank: NoiseBank, dice: Dice, size: int = 256) -> Image:
    """Worn yellow and black stripes at 45 degrees; tileable."""
    i, j = np.indices((size, size))
    dark = ((i + j) // (size // 4)) % 2 == 0
    shade = np.float32(0.75) + bank.take("cloud", size, dice) * np.float32(0.25)
    return np.where(dark[:, :, None], paint(shade, (44, 42, 40)), paint(shade, (242, 194, 40)))


def tape(bank: NoiseBank, dice: Dice, colour: Colour, size: int = 256) -> Image:
    """Floor marking, scuffed through to the concrete in places; tileable."""
    grain, cloud = bank.take("grain", size, dice), bank.take("cloud", size, dice)
    worn = grain * np.float32(0.4) + cloud * np.float32(0.6) < np.float32(0.36)
    image = paint(np.float32(0.8) + grain * np.float32(0.2), colour)
    image[worn] = paint(np.float32(0.8) + grain * np.float32(0.3), (150, 148, 142))[worn]
    return image


def ribs(bank: NoiseBank, dice: Dice, colour: Colour, count: int = 16, size: int = 512) -> Image:
    """Sheet metal with horizontal ribs, dented and dusty; tileable."""
    across = (np.arange(size) * count % size).astype(np.float32) / np.float32(size)
    fold = np.abs(across - np.float32(0.5)) * np.float32(0.5) + np.float32(0.66)
    shade = fold[:, None] + bank.take("cloud", size, dice) * np.float32(0.16)
    shade = shade + bank.take("grain", size, dice) * np.float32(0.07)
    return paint(shade, colour)


def carton(bank: NoiseBank, dice: Dice, colour: Colour, size: int = 192) -> Image:
    """One face of a cardboard box: fibres, packing tape, a label with a barcode, a printed mark."""
    grain, fibre = bank.take("grain", 256, dice)[:size, :size], bank.take("wood", 256, dice)[:size, :size]
    image = paint(np.float32(0.78) + grain * np.float32(0.18) + fibre * np.float32(0.14), colour)
    for edge in (np.s_[:3], np.s_[-3:], np.s_[:, :3], np.s_[:, -3:]):
        image[edge] //= 2
    middle, half = size // 2 + dice.integer(-3, 4), size // 26
    tape_colour = dice.choice([(214, 186, 132), (196, 160, 104), (232, 226, 212)])
    strip = image[:, middle - half : middle + half]
    strip[:] = strip // 3 + np.array(tape_colour, np.uint8) // 3 * 2
    row, column = dice.integer(size // 10, size // 2), dice.choice([size // 12, size * 7 // 12])
    label = image[row : row + size // 4, column : column + size // 3]
    label[:] = (244, 242, 236)
    _barcode(label[label.shape[0] // 2 : -4, 5:-5], dice)
    _lines(label[4 : label.shape[0] // 2 - 3, 5:-5], dice, (60, 60, 60), 5)
    if dice.uniform() < 0.6:
        text = "".join(dice.choice("0123456789ABCDEFHLPRSTX") for _ in range(dice.integer(2, 5)))
        mark = sign(text, (0, 0, 0), (255, 255, 255), cell=size // 64 + 1)[:, :, 0] > 0
        at = image[-size // 4 :, size // 10 :][: mark.shape[0], : mark.shape[1]]
        fitting = mark[: at.shape[0], : at.shape[1]]
        at[fitting] = dice.choice(_INK)
    return image


def _barcode(area: Image, dice: Dice) -> None:
    column = 0
    while column < area.shape[1]:
        wide = dice.integer(1, 4)
        area[:, column : column + wide] = (24, 24, 24)
        column += wide + dice.integer(1, 4)


def _lines(area: Image, dice: Dice, ink: Colour, pitch: int) -> None:
    """Rule an area with lines of text: words of random length."""
    thick = max(pitch // 2, 1)
    for row in range(0, area.shape[0] - thick, pitch):
        column, end = 0, int(area.shape[1] * dice.uniform(0.55, 1.0))
        while column < end:
            word = dice.integer(3, 14)
            area[row : row + thick, column : min(column + word, end)] = ink
            column += word + 3


def notice_board(bank: NoiseBank, dice: Dice, width: int, height: int) -> Image:
    """Cork with sheets of paper: headings, text, pictures, pins."""
    grain = bank.take("grain", 1024, dice)[:height, :width]
    image = paint(np.float32(0.7) + grain * np.float32(0.45), (190, 146, 98))
    step_x, step_y = max(width // 5, 60), max(height // 3, 70)
    for top in range(6, height - step_y // 2, step_y):
        for left in range(6, width - step_x // 2, step_x):
            if dice.uniform() < 0.12:
                continue
            row, column = top + dice.integer(0, 12), left + dice.integer(0, 12)
            tall, wide = int(step_y * dice.uniform(0.6, 0.9)), int(step_x * dice.uniform(0.55, 0.9))
            sheet = image[row : row + tall, column : column + wide]
            if sheet.shape[0] > 24 and sheet.shape[1] > 24:
                _sheet(sheet, dice, bank)
    return image


def _sheet(sheet: Image, dice: Dice, bank: NoiseBank) -> None:
    """Print one sheet of paper, pinned at its top."""
    tall, wide = sheet.shape[:2]
    sheet[:] = dice.choice(_PAPER)
    ink = dice.choice(_INK)
    sheet[6:12, 5 : int(wide * dice.uniform(0.5, 0.9))] = ink
    body = sheet[17 : tall - 4, 5 : wide - 5]
    if dice.uniform() < 0.45 and tall > 40:
        cut = body.shape[0] // 2
        cloud = bank.take("cloud", 256, dice)[:cut, : body.shape[1]]
        part = body[: cloud.shape[0], : cloud.shape[1]]
        colour = dice.choice([(90, 140, 190), (200, 130, 70), (110, 160, 90), (170, 90, 120)])
        part[:] = paint(np.float32(0.4) + cloud * np.float32(0.8), colour)
        body = body[cut + 4 :]
    _lines(body, dice, (90, 92, 100), 5)
    sheet[1:5, wide // 2 - 2 : wide // 2 + 2] = dice.choice([(210, 40, 40), (40, 90, 200), (240, 200, 40)])


def whiteboard(bank: NoiseBank, dice: Dice, width: int, height: int) -> Image:
    """A used whiteboard: wiped smears, boxes joined by lines, handwriting, a curve."""
    smear = bank.take("cloud", 1024, dice)[:height, :width]
    image = paint(np.float32(0.93) + smear * np.float32(0.06), (250, 252, 252))
    for _ in range(5):
        row, column = dice.integer(8, height * 2 // 3), dice.integer(8, width * 3 // 4)
        tall, wide = dice.integer(height // 8, height // 4), dice.integer(width // 12, width // 5)
        ink = dice.choice(_INK)
        box = image[row : row + tall, column : column + wide]
        box[:3], box[-3:], box[:, :3], box[:, -3:] = ink, ink, ink, ink
        _lines(box[8:-6, 8:-6], dice, ink, 9)
        image[row + tall // 2 : row + tall // 2 + 3, column + wide : column + wide + width // 12] = ink
    corner = image[int(height * 0.72) : -8, 12 : width // 2]
    _lines(corner, dice, dice.choice(_INK), 12)
    return image


def shelf_of_files(bank: NoiseBank, dice: Dice, width: int = 512, height: int = 160) -> Image:
    """A row of lever-arch files with labels, half a metre wide."""
    image = np.full((height, width, 3), 30, np.uint8)
    grain = bank.take("grain", 512, dice)[:height, :width]
    colours: list[Colour] = [(40, 60, 100), (150, 40, 40), (60, 62, 66), (40, 100, 70), (214, 180, 60), (200, 200, 196)]
    column = 0
    while column < width:
        thick = dice.choice([28, 36, 44])
        part = (slice(dice.integer(2, 14), height), slice(column, min(column + thick, width)))
        image[part] = paint(np.float32(0.8) + grain[part] * np.float32(0.3), dice.choice(colours))
        label = image[height // 4 : height * 2 // 3, column + 6 : column + thick - 6]
        label[:] = (240, 238, 230)
        _lines(label[6:-4, 3:-3], dice, (70, 70, 76), 7)
        image[:, column : column + 2] //= 3
        column += thick
    return image


def fleck(bank: NoiseBank, dice: Dice, ground: Colour, chips: list[Colour], size: int = 512) -> Image:
    """Linoleum or terrazzo: small chips on an even ground; tileable."""
    image = paint(np.float32(0.94) + bank.take("cloud", size, dice) * np.float32(0.08), ground)
    field = bank.take("grain", size, dice)
    levels: list[npt.NDArray[np.bool_]] = [
        field > np.float32(0.72),
        field < np.float32(0.28),
        np.abs(field - np.float32(0.5)) < np.float32(0.012),
    ]
    for colour, mask in zip(chips, levels, strict=False):
        image[mask] = image[mask] // 3 + np.array(colour, np.uint8) // 3 * 2
    return image


def concrete(bank: NoiseBank, dice: Dice, colour: Colour, joints: int = 2, size: int = 1024) -> Image:
    """Power-trowelled concrete: stains at every scale, pores, tyre marks, sawn joints; tileable."""
    cloud, stain, grain = (bank.take(kind, size, dice) for kind in ("cloud", "cloud", "grain"))
    shade = np.float32(0.70) + cloud * np.float32(0.24) + grain * np.float32(0.14)
    shade[stain > np.float32(0.66)] *= np.float32(0.90)
    shade[bank.take("grain", size, dice) > np.float32(0.76)] *= np.float32(0.72)
    for _ in range(5):
        at, wide = dice.integer(0, size), dice.integer(6, 16)
        shade[:, np.arange(at, at + wide) % size] *= np.float32(0.94)
    for k in range(joints):
        at = k * (size // joints)
        shade[at : at + 3] *= np.float32(0.55)
        shade[:, at : at + 3] *= np.float32(0.55)
    return paint(shade, colour)
