import numpy as np
import pytest

from taskslam.world.builtin import pictures, textures
from taskslam.world.builtin.noise import Dice, NoiseBank, fractal_noise, lattice_noise

BANK = NoiseBank(3)
SURFACES = {
    "plaster": lambda dice: textures.plaster(BANK, dice, (230, 220, 210), 512),
    "wood": lambda dice: textures.wood(BANK, dice, (120, 80, 40), (200, 160, 100), 512),
    "planks": lambda dice: textures.planks(BANK, dice, (120, 80, 40), (200, 160, 100), 512),
    "tiles": lambda dice: textures.tiles(BANK, dice, [(220, 220, 210), (90, 100, 110)], (60, 60, 60), 512),
    "bricks": lambda dice: textures.bricks(BANK, dice, [(158, 82, 62)], (190, 180, 170), 512),
    "wallpaper": lambda dice: textures.wallpaper(BANK, dice, (220, 220, 210), [(120, 150, 130)], 512),
    "fabric": lambda dice: textures.fabric(BANK, dice, (80, 110, 140), 512),
    "stone": lambda dice: textures.stone(BANK, dice, (44, 44, 50), (150, 148, 146), 512),
}


def test_dice_follow_the_raw_pcg64_stream():
    dice = Dice(7)
    raw = np.random.PCG64(np.random.SeedSequence([7])).random_raw(3)
    assert [dice.uniform() for _ in range(3)] == [(int(r) >> 11) * 2.0**-53 for r in raw]


def test_dice_cover_their_range():
    dice = Dice(1)
    assert {dice.integer(2, 5) for _ in range(200)} == {2, 3, 4}
    values = dice.uniforms(50, 40)
    assert values.shape == (50, 40)
    assert 0 <= values.min() < 0.01
    assert 0.99 < values.max() < 1


def test_lattice_noise_passes_through_its_lattice_and_wraps():
    lattice = Dice(5).uniforms(4, 8).astype(np.float32)
    noise = lattice_noise(Dice(5), (32, 64), (4, 8))
    assert np.array_equal(noise[::8, ::8], lattice)
    assert np.abs(noise[0] - noise[-1]).max() < 0.15


def test_fractal_noise_uses_its_whole_range():
    noise = fractal_noise(Dice(5), (64, 64), (4, 4), 4)
    assert (noise.min(), noise.max()) == (0.0, 1.0)


@pytest.mark.parametrize("name", SURFACES)
def test_a_surface_tiles_without_a_seam(name):
    image = SURFACES[name](Dice(11)).astype(np.float64).mean(axis=2)
    for axis in range(2):
        steps = np.abs(np.diff(image, axis=axis)).mean(axis=1 - axis)
        seam = np.abs(np.take(image, 0, axis) - np.take(image, -1, axis)).mean()
        assert seam <= steps.max() * 1.05


@pytest.mark.parametrize("name", SURFACES)
def test_a_surface_has_structure_everywhere(name):
    """A tracker needs contrast in every patch: at least 1.5 grey levels in each 32 px square."""
    image = SURFACES[name](Dice(11)).astype(np.float64).mean(axis=2)
    patches = image.reshape(16, 32, 16, 32).std(axis=(1, 3))
    assert patches.min() > 1.5


@pytest.mark.parametrize("name", SURFACES)
def test_a_surface_repeats_only_with_its_seed(name):
    assert np.array_equal(SURFACES[name](Dice(11)), SURFACES[name](Dice(11)))
    assert not np.array_equal(SURFACES[name](Dice(11)), SURFACES[name](Dice(12)))


@pytest.mark.parametrize("size", [(64, 64), (300, 90), (90, 300), (1024, 700)])
def test_pictures_take_any_size(size):
    wide, tall = size
    assert pictures.rug(BANK, Dice(2), wide, tall).shape == (tall, wide, 3)
    if max(size) <= 512:
        assert pictures.painting(BANK, Dice(2), wide, tall).shape == (tall, wide, 3)


def test_a_rug_is_symmetric_apart_from_its_weave():
    rug = pictures.rug(BANK, Dice(2), 256, 256).astype(np.float64)
    across, other = np.abs(rug - rug[:, ::-1]).mean(), np.abs(rug - np.roll(rug, 64, axis=1)).mean()
    assert across < 0.6 * other
