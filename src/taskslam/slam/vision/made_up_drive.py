"""A made-up drive for compiling before the first real pair: past a wall of random tiles, sideways."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from taskslam.measurements import NANOSECONDS
from taskslam.slam.vision.pinhole import Pinhole
from taskslam.slam.vision.pyramid import GreyImage

SIDE, _BLOCK, _DISPARITY, _STEP = 256, 8, 8, 3
PINHOLE = Pinhole(160.0, SIDE / 2, SIDE / 2, 0.1)


def made_up_drive(pairs: int) -> Iterator[tuple[GreyImage, GreyImage, int]]:
    """So many left and right pictures, `SIDE` pixels square, and stamps in ns."""
    for number in range(pairs):
        yield *made_up_pair(_STEP * number), number * NANOSECONDS // 30


def made_up_pair(at: int) -> tuple[GreyImage, GreyImage]:
    """Left and right picture from so many pixels along the wall."""
    wall = _wall()
    return wall[:, at : at + SIDE], wall[:, at + _DISPARITY : at + _DISPARITY + SIDE]


@cache
def _wall() -> GreyImage:
    tiles = np.random.Generator(np.random.PCG64(0)).integers(0, 256, (SIDE // _BLOCK, 2 * SIDE // _BLOCK))
    return np.kron(tiles, np.ones((_BLOCK, _BLOCK))).astype(np.uint8)
