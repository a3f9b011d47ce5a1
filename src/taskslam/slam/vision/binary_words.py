"""Distances between binary descriptors, kept as four words of 64 bits each."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit

Words: TypeAlias = npt.NDArray[np.uint64]
"""(N, 4) descriptors of 256 bits."""

_PAIRS, _FOURS = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333)
_EIGHTS, _SUM = np.uint64(0x0F0F0F0F0F0F0F0F), np.uint64(0x0101010101010101)
_1, _2, _4, _56 = np.uint64(1), np.uint64(2), np.uint64(4), np.uint64(56)


def as_words(descriptors: npt.NDArray[np.uint8]) -> Words:
    """(N, 4) of (N, 32) bytes."""
    return np.ascontiguousarray(descriptors).view(np.uint64).reshape(-1, 4)


@njit(cache=True)
def hamming(a: Words, i: int, b: Words, j: int) -> int:
    """Bits in which row i of a differs from row j of b, counted in parallel (Warren, Hacker's Delight, 5-1)."""
    total = 0
    for k in range(4):
        x = a[i, k] ^ b[j, k]
        x = x - ((x >> _1) & _PAIRS)
        x = (x & _FOURS) + ((x >> _2) & _FOURS)
        x = (x + (x >> _4)) & _EIGHTS
        total += int((x * _SUM) >> _56)
    return total
