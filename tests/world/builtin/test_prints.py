import numpy as np
import pytest

from taskslam.world.builtin import prints
from taskslam.world.builtin.noise import Dice, NoiseBank

BANK = NoiseBank(3)
TILEABLE = {
    "hazard": lambda dice: prints.hazard(BANK, dice),
    "tape": lambda dice: prints.tape(BANK, dice, (240, 196, 40)),
    "ribs": lambda dice: prints.ribs(BANK, dice, (150, 160, 168)),
    "fleck": lambda dice: prints.fleck(BANK, dice, (196, 202, 200), [(150, 160, 160), (236, 238, 234), (90, 90, 90)]),
    "concrete": lambda dice: prints.concrete(BANK, dice, (176, 174, 168), size=512),
}
ONCE = {
    "carton": lambda dice: prints.carton(BANK, dice, (188, 146, 98)),
    "notice board": lambda dice: prints.notice_board(BANK, dice, 760, 400),
    "whiteboard": lambda dice: prints.whiteboard(BANK, dice, 700, 400),
    "files": lambda dice: prints.shelf_of_files(BANK, dice),
}


def test_a_sign_shows_its_characters_in_ink_on_ground():
    plate = prints.sign("L1", (10, 20, 30), (250, 240, 230), cell=2)
    assert plate.shape == (14, 18, 3)
    cells = (plate[::2, ::2] == (250, 240, 230)).all(axis=2)
    drawn = ["".join("#" if cell else "." for cell in row) for row in cells]
    assert drawn == [
        ".........",
        ".#....#..",
        ".#...##..",
        ".#....#..",
        ".#....#..",
        ".###.###.",
        ".........",
    ]


@pytest.mark.parametrize("name", TILEABLE)
def test_a_print_tiles_without_a_seam(name):
    image = TILEABLE[name](Dice(11)).astype(np.float64).mean(axis=2)
    for axis in range(2):
        steps = np.abs(np.diff(image, axis=axis)).mean(axis=1 - axis)
        seam = np.abs(np.take(image, 0, axis) - np.take(image, -1, axis)).mean()
        assert seam <= steps.max() * 1.05


@pytest.mark.parametrize("name", [*TILEABLE, *ONCE])
def test_a_print_repeats_only_with_its_seed(name):
    make = (TILEABLE | ONCE)[name]
    assert np.array_equal(make(Dice(11)), make(Dice(11)))
    assert not np.array_equal(make(Dice(11)), make(Dice(12)))


@pytest.mark.parametrize("name", ONCE)
def test_a_print_gives_a_camera_corners(name):
    image = ONCE[name](Dice(5)).astype(np.float64).mean(axis=2)
    assert image.std() > 8


@pytest.mark.parametrize("size", [(80, 80), (120, 700), (1024, 300)])
def test_boards_take_any_size(size):
    wide, tall = size
    assert prints.notice_board(BANK, Dice(2), wide, tall).shape == (tall, wide, 3)
    assert prints.whiteboard(BANK, Dice(2), wide, tall).shape == (tall, wide, 3)
