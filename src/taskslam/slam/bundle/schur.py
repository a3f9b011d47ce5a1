"""The Schur complement on inverse depths: poses are solved for with every depth eliminated, then each depth by itself.

    [ H   W^T ] [ xi ]     [ b   ]           (H - sum_n w_n w_n^T / h_n) xi = -(b - sum_n w_n g_n / h_n)
    [ W   h   ] [ d  ] = - [ g   ],          d_n = -(g_n + w_n . xi) / h_n

(Triggs et al. 2000, "Bundle adjustment: a modern synthesis", section 6.1; h is diagonal.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray
from taskslam.slam.vision.cholesky import solve_positive

_UNOBSERVED = 1e-3  # information about an inverse depth, m^2, below which it stays what it is


class NormalEquations(NamedTuple):
    """H: (D, D) and b: (D,) over poses, h: (N,) and g: (N,) over inverse depths, W: (N, D) between them."""

    H: FloatArray
    b: FloatArray
    W: FloatArray
    h: FloatArray
    g: FloatArray


@njit(cache=True)
def solve_by_schur(equations: NormalEquations, fixed: int, damping: float) -> tuple[FloatArray, FloatArray, bool]:
    """(D,) step of the poses and (N,) of the inverse depths.

    fixed: so many of the first coordinates do not move (the gauge). damping: what every diagonal entry is raised by,
    relative (Levenberg-Marquardt). False, and zeros, if the poses are not determined.
    """
    H, b, W, h, g = equations
    D, N = len(b), len(h)
    S, s = H.copy(), b.copy()
    inverse = np.zeros(N)
    for n in range(N):
        if h[n] > _UNOBSERVED:
            inverse[n] = 1.0 / (h[n] * (1.0 + damping))
            for i in range(fixed, D):
                w = W[n, i] * inverse[n]
                if w != 0.0:
                    s[i] -= w * g[n]
                    for j in range(fixed, i + 1):
                        S[i, j] -= w * W[n, j]
    for i in range(D):
        for j in range(i):
            S[j, i] = S[i, j]
    for i in range(D):
        S[i, i] += damping * H[i, i] + 1e-9
    for i in range(fixed):
        S[i, :] = 0.0
        S[:, i] = 0.0
        S[i, i] = 1.0
        s[i] = 0.0
    step, solved = solve_positive(S, -s)
    depths = np.zeros(N)
    if solved:
        for n in range(N):
            if inverse[n] > 0.0:
                total = g[n]
                for i in range(D):
                    total += W[n, i] * step[i]
                depths[n] = -inverse[n] * total
    return step, depths, solved
