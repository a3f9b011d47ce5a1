"""Random numbers and tileable noise that come out the same on every machine and with every numpy.

`numpy.random.Generator` may change its streams between releases and libm may differ in the last bit, so this uses the
raw PCG64 stream (which numpy promises to keep) and only additions, multiplications and square roots.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt

Field = npt.NDArray[np.float32]
T = TypeVar("T")


class Dice:
    """A seeded source of uniform numbers."""

    def __init__(self, *seed: int) -> None:
        self._bits = np.random.PCG64(np.random.SeedSequence(list(seed)))

    def uniform(self, low: float = 0.0, high: float = 1.0) -> float:
        """One number in [low, high)."""
        return low + (high - low) * float(self._bits.random_raw() >> 11) * 2.0**-53

    def uniforms(self, *shape: int) -> npt.NDArray[np.float64]:
        """Array of numbers in [0, 1)."""
        count = int(np.prod(shape))
        raw: npt.NDArray[np.uint64] = self._bits.random_raw(count)
        return ((raw >> np.uint64(11)).astype(np.float64) * 2.0**-53).reshape(shape)

    def integer(self, low: int, high: int) -> int:
        """One whole number in low..high - 1."""
        return low + int(self.uniform() * (high - low))

    def choice(self, items: Sequence[T]) -> T:
        """One of the items."""
        return items[self.integer(0, len(items))]


def lattice_noise(dice: Dice, size: tuple[int, int], cells: tuple[int, int]) -> Field:
    """(H, W) smooth value noise in 0..1 over a wrapping lattice of `cells` (rows, columns) random values."""
    lattice = dice.uniforms(*cells).astype(np.float32)
    rows = _stretch(lattice, size[0])
    return np.ascontiguousarray(_stretch(np.ascontiguousarray(rows.T), size[1]).T)


def _stretch(values: Field, size: int) -> Field:
    """Interpolate the first axis to `size` samples, periodic, with the smoothstep weight t^2 (3 - 2 t)."""
    count = len(values)
    if count == size:
        return values
    at = np.arange(size, dtype=np.float64) * (count / size)
    low = at.astype(np.int64)
    t = at - low
    weight = (t * t * (3.0 - 2.0 * t)).astype(np.float32)[:, None]
    low %= count
    stretched: Field = values[low] * (np.float32(1.0) - weight) + values[(low + 1) % count] * weight
    return stretched


def fractal_noise(dice: Dice, size: tuple[int, int], cells: tuple[int, int], octaves: int, gain: float = 0.6) -> Field:
    """(H, W) sum of lattice noises, each twice as fine and `gain` times as strong, stretched to 0..1."""
    total = np.zeros(size, np.float32)
    strength = np.float32(1.0)
    for octave in range(octaves):
        scale = 1 << octave
        fine = (min(cells[0] * scale, size[0]), min(cells[1] * scale, size[1]))
        total += lattice_noise(dice, size, fine) * strength
        strength *= np.float32(gain)
    low, high = total.min(), total.max()
    stretched: Field = (total - low) / (high - low)
    return stretched


class NoiseBank:
    """A few noise fields, computed once per size and shifted for every use, because making them costs most."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._fields: dict[tuple[str, int], Field] = {}

    def take(self, kind: str, size: int, dice: Dice) -> Field:
        """(size, size) field in 0..1, shifted at random. kind: `cloud` (all scales), `grain` (fine), `wood`."""
        key = (kind, size)
        if key not in self._fields:
            self._fields[key] = self._make(kind, size)
        shift = (dice.integer(0, size), dice.integer(0, size))
        return np.roll(self._fields[key], shift, axis=(0, 1))

    def _make(self, kind: str, size: int) -> Field:
        dice = Dice(self._seed, size, len(kind))
        shape = (size, size)
        if kind == "cloud":
            return fractal_noise(dice, shape, (4, 4), 7, 0.65)
        if kind == "grain":
            return fractal_noise(dice, shape, (size // 8, size // 8), 4, 0.9)
        # fibres run along the columns (u); most strength in fine lines across
        return fractal_noise(dice, shape, (size // 32, 2), 5, 0.8)
