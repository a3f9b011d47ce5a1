"""Small symmetric positive definite matrices by Cholesky; compiled, and summed in the same order on every machine."""

from __future__ import annotations

import math

import numpy as np

from taskslam.compiled import njit
from taskslam.geometry import FloatArray


@njit(cache=True)
def factor(A: FloatArray) -> tuple[FloatArray, bool]:
    """L, whose lower triangle has L L^T = A for a symmetric (N, N) A; False where A is not positive definite."""
    n = len(A)
    L = A.copy()
    for j in range(n):
        for k in range(j):
            for i in range(j, n):
                L[i, j] -= L[i, k] * L[j, k]
        if not L[j, j] > 0.0:
            return L, False
        root = math.sqrt(L[j, j])
        for i in range(j, n):
            L[i, j] /= root
    return L, True


@njit(cache=True)
def solve_positive(A: FloatArray, b: FloatArray) -> tuple[FloatArray, bool]:
    """X of A x = b for a symmetric positive definite (N, N) A; False, and zeros, where A is not."""
    n = len(b)
    L, positive = factor(A)
    if not positive:
        return np.zeros(n), False
    x = b.copy()
    for i in range(n):
        for k in range(i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= L[k, i] * x[k]
        x[i] /= L[i, i]
    return x, True


@njit(cache=True)
def log_determinant(A: FloatArray) -> float:
    """Of a symmetric (N, N) matrix; minus infinity where it is not positive definite."""
    L, positive = factor(A)
    if not positive:
        return -np.inf
    total = 0.0
    for j in range(len(A)):
        total += math.log(L[j, j])
    return 2.0 * total
