"""Which keyframes are adjusted, where there are more than the budget: those that determine the most together.

Zhao, Smith and Vela 2020: of the reduced camera system S of all candidates, in which every point is eliminated, the
principal submatrix with the largest log-determinant is looked for, one keyframe after another, each time the one that
adds most: log det S_jj|A, with S_jj|A = S_jj - S_jA S_AA^-1 S_Aj (the Schur complement on those chosen before). It is
found by a Cholesky factorisation that goes on where it stood: a row of blocks is kept for every candidate.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.cholesky import log_determinant

Ints = npt.NDArray[np.int64]


@njit(cache=True)
def select_blocks(S: FloatArray, first: Ints, wanted: int) -> Ints:
    """(wanted,) blocks of six in (6 F, 6 F) S: those of `first`, then one after another what adds most.

    Fewer, where no further one is determined.
    """
    count = len(S) // 6
    wanted = min(wanted, count)
    chosen = np.empty(wanted, np.int64)
    rest = S.copy()  # what of S those chosen do not explain
    free = np.ones(count, np.bool_)
    for n in range(wanted):
        best, block = -np.inf, -1
        if n < len(first):
            block = first[n]
        else:
            for j in range(count):
                if free[j]:
                    gain = log_determinant(rest[6 * j : 6 * j + 6, 6 * j : 6 * j + 6])
                    if gain > best:
                        best, block = gain, j
        if block < 0:
            return chosen[:n]
        chosen[n] = block
        free[block] = False
        for row in range(6 * block, 6 * block + 6):
            _eliminate(rest, row, free)
    return chosen


@njit(cache=True)
def _eliminate(rest: FloatArray, row: int, free: npt.NDArray[np.bool_]) -> None:
    """Take out what one row of a chosen block explains of the others, and of its own block's."""
    pivot = rest[row, row]
    if not pivot > 0.0:
        return
    own = row // 6
    for j in range(len(free)):
        if not free[j] and j != own:
            continue
        for i in range(6 * j, 6 * j + 6):
            if i == row or (j == own and i < row):
                continue
            factor = rest[i, row] / pivot
            if factor == 0.0:
                continue
            for k in range(len(rest)):
                if k == row or not (free[k // 6] or (k // 6 == own and k > row)):
                    continue
                rest[i, k] -= factor * rest[row, k]
