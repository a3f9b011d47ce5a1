"""Permutation tests for two methods: would the same data, dealt out to them by chance, differ as much?

Dealt out are whole rounds, because arrivals in a round share the drive. Flipping single waypoints instead would call
one lucky round a dozen independent witnesses (`benchmarks/interval_coverage.py` shows how often that misleads).
"""

from __future__ import annotations

import itertools
import math
import zlib
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray

MOST_SPLITS = 1000
DRAWS = 4999

Statistic = Callable[[FloatArray, FloatArray], FloatArray]


def exchange_rounds(
    pairs: Sequence[tuple[FloatArray, FloatArray]], statistic: Statistic, seed: str
) -> tuple[float, float]:
    """Two-sided p and the smallest p that these rounds allow.

    pairs: for each sequence the rounds of either method, (M_a, ...) and (M_b, ...), exchangeable if the methods are
    alike. statistic: from (S, M_a, ...) and (S, M_b, ...) rounds to (S,) numbers, which add up over sequences. Exact
    for one sequence with at most 1000 ways to deal; else 4999 random deals, seeded by the text.
    """
    random = np.random.default_rng(zlib.crc32(seed.encode()))
    values, ways = [], 1.0
    for a, b in pairs:
        splits = _splits(len(a), len(b)) if math.comb(len(a) + len(b), len(a)) <= MOST_SPLITS else None
        ways *= math.comb(len(a) + len(b), len(a)) / (2 if len(a) == len(b) else 1)
        if splits is None:
            splits = np.array(
                [np.arange(len(a) + len(b))] + [random.permutation(len(a) + len(b)) for _ in range(MOST_SPLITS - 1)]
            )
        rounds = np.concatenate([a, b])
        values.append(statistic(rounds[splits[:, : len(a)]], rounds[splits[:, len(a) :]]))
    observed = sum(float(value[0]) for value in values)
    if len(pairs) == 1 and ways <= MOST_SPLITS:
        return float(_as_large(values[0], observed).mean()), 1 / ways
    sums = sum((value[random.integers(len(value), size=DRAWS)] for value in values), np.zeros(DRAWS))
    return (1 + float(_as_large(sums, observed).sum())) / (1 + DRAWS), max(1 / ways, 1 / (1 + DRAWS))


def flip_signs(differences: FloatArray, seed: str) -> tuple[float, float]:
    """Two-sided p of (S,) differences under changes of their signs, and the smallest p possible.

    Exact up to 12 of them, else 4999 random choices, seeded by the text.
    """
    count = len(differences)
    if count <= 12:
        signs = np.array(list(itertools.product((1.0, -1.0), repeat=count)))
        return float(_as_large(signs @ differences, float(differences.sum())).mean()), 2.0 ** (1 - count)
    random = np.random.default_rng(zlib.crc32(seed.encode()))
    sums = random.choice([1.0, -1.0], size=(DRAWS, count)) @ differences
    return (1 + float(_as_large(sums, float(differences.sum())).sum())) / (1 + DRAWS), 1 / (1 + DRAWS)


def holm(p_values: Sequence[float]) -> list[float]:
    """Holm's step-down correction: the chance of even one false call among all comparisons stays below the level.

    Holm: A Simple Sequentially Rejective Multiple Test Procedure, Scand. J. Statistics 6 (1979). In the given order.
    """
    order = sorted(range(len(p_values)), key=lambda index: p_values[index])
    adjusted, largest = [0.0] * len(p_values), 0.0
    for rank, index in enumerate(order):
        largest = max(largest, min(1.0, (len(p_values) - rank) * p_values[index]))
        adjusted[index] = largest
    return adjusted


def cliffs_delta(a: FloatArray, b: FloatArray) -> float:
    """P(a > b) - P(a < b) over all pairs of values: -1 where every a is below every b (Cliff 1993)."""
    ordered = np.sort(b)
    below = np.searchsorted(ordered, a, "left").sum()
    above = len(a) * len(b) - np.searchsorted(ordered, a, "right").sum()
    return float((below - above) / (len(a) * len(b)))


def _as_large(values: FloatArray, observed: float) -> npt.NDArray[np.bool_]:
    return np.asarray(np.abs(values) >= abs(observed) - 1e-9 * max(1.0, abs(observed)))


@lru_cache(maxsize=64)
def _splits(first: int, second: int) -> npt.NDArray[np.int64]:
    """Every way to deal first + second rounds to two methods, the given one first; (C, first + second) indices."""
    everything = set(range(first + second))
    return np.array(
        [
            [*chosen, *sorted(everything - set(chosen))]
            for chosen in itertools.combinations(range(first + second), first)
        ]
    )
