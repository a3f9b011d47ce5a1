"""How many runs? Rounds and seeds that tell a given difference of two methods' E from chance.

Two methods are compared over seeds, each driven by both: the mean of the seeds' log(E_a / E_b) by a paired t test, and
by swapping whole runs (`comparison.py`); both must say so. A seed's mean log E over its waypoints scatters between
seeds with variance s_seeds^2 + s_rounds^2 / M in M rounds (rounds nest in seeds), so that a pair's difference has the
variance

    V = 2 (s_seeds^2 + s_rounds^2 / M),

and S seeds find a ratio of 1 + d with the power of the noncentral t distribution,

    P(t > t(S - 1)) with noncentrality log(1 + d) sqrt(S / V)

(Cohen: Statistical Power Analysis for the Behavioral Sciences, 1988, ch. 2). What methods have in common in a seed
makes V smaller, so a plan is rather too large. With few seeds the swaps decide: of 6 seeds each must point the same
way. Up to 9 seeds the power is therefore counted, over draws from the normal distribution with a fixed seed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import nctdtr, stdtrit

from taskslam.evaluation.evidence import Sides
from taskslam.evaluation.metrics_file import RunMetrics
from taskslam.evaluation.seeds import FEWEST_TO_DECIDE
from taskslam.geometry import FloatArray

ALPHA = 0.05
POWER = 0.80
DETECT = 0.20
"""The relative difference of E that a plan is for, where none is given."""

MOST_SEEDS = 1000
ROUNDS = range(5, 21)
"""Rounds that a plan may choose from: the paper's five at least, so that E is comparable with what it publishes."""

_COUNTED = 9  # seeds up to which the power is counted
_DRAWS = 4000


@dataclass(frozen=True)
class Scatter:
    """How a method's log E, the mean over the waypoints of a seed, scatters: standard deviations.

    seeds: between seeds, beyond what their rounds explain; rounds: that one round alone would have.
    """

    seeds: float
    rounds: float

    def variance(self, rounds: int) -> float:
        """Of the mean log E of one seed with so many rounds."""
        return self.seeds**2 + self.rounds**2 / rounds


ASSUMED = Scatter(seeds=0.2, rounds=0.3)
"""Where no runs at hand tell (`scatter_of`). One round of karto in the built-in house has 0.24; seeds are a guess."""


@dataclass(frozen=True)
class Design:
    """So many rounds of each of so many seeds find the difference with this power."""

    rounds: int
    seeds: int
    power: float

    @property
    def words(self) -> str:
        """As a plan says it: `30 seeds of 5 rounds, power 81%`."""
        return f"{self.seeds} seeds of {self.rounds} rounds, power {self.power:.0%}"

    def driven(self, with_map: bool = False) -> int:
        """Rounds to drive for each method, the priming round of every seed included."""
        return self.seeds * (self.rounds + with_map)


def runs_needed(
    detect: float = DETECT,
    scatter: Scatter = ASSUMED,
    *,
    rounds: int | None = None,
    comparisons: int = 1,
    with_map: bool = False,
    power: float = POWER,
) -> Design | None:
    """The rounds and seeds that find a relative difference `detect` of E with the least driving; None above 1000 seeds.

    rounds: of each seed, if that is settled; comparisons: pairs of methods that are judged together, whose level is 5 %
    over their number (Bonferroni, which Holm's correction is never worse than). Raises ValueError for a difference that
    is not positive.
    """
    if not detect > 0:
        raise ValueError(f"a difference of {detect:g} cannot be detected; expected more than 0, such as 0.2 for 20 %")
    found = [
        Design(own, seeds, power_of(detect, scatter.variance(own), seeds, comparisons))
        for own in ([rounds] if rounds is not None else ROUNDS)
        if (seeds := _seeds(detect, scatter.variance(own), comparisons, power)) is not None
    ]
    return min(found, key=lambda design: (design.driven(with_map), design.seeds), default=None)


def power_of(detect: float, variance: float, seeds: int, comparisons: int = 1) -> float:
    """The chance that so many seeds tell a relative difference of E; variance: of one method's mean log E in a seed."""
    return _power(math.log1p(detect) / math.sqrt(2 * max(variance, 1e-12)), seeds, ALPHA / comparisons)


def seeds_needed(difference: float, deviation: float) -> int | None:
    """Seeds that find a mean log ratio of this size with a power of 80 %; deviation: of one seed's; None above 1000."""
    if difference == 0:
        return None
    return _fewest(abs(difference) / max(deviation, 1e-12), ALPHA, POWER)


def scatter_of(runs: Iterable[RunMetrics]) -> Scatter | None:
    """What several seeds of one method in one mode at one scenario say of its scatter; None below two seeds.

    Over the waypoints that every seed completed. The variance between seeds is that of their means, less what their
    rounds explain by the jackknife, and not below 0.
    """
    sides = Sides("precision")
    runs = list(runs)
    common = frozenset[int].intersection(*(sides.complete(run) for run in runs)) if runs else frozenset[int]()
    found = [side for run in runs if (side := sides.side(run, common)) is not None and side.variance is not None]
    if len(found) < 2:
        return None
    within = float(np.mean([side.variance for side in found]))
    of_one_round = float(np.mean([(side.variance or 0.0) * side.rounds for side in found]))
    between = float(np.var([side.logs.mean() for side in found], ddof=1))
    return Scatter(seeds=math.sqrt(max(between - within, 0.0)), rounds=math.sqrt(of_one_round))


def pooled_scatter(scatters: Sequence[Scatter]) -> Scatter:
    """Root mean squares of the scatters of several methods or places. Raises ValueError for none."""
    if not scatters:
        raise ValueError("no scatter to pool; expected that of at least one method")
    return Scatter(
        *(math.sqrt(float(np.mean([getattr(one, name) ** 2 for one in scatters]))) for name in ("seeds", "rounds"))
    )


def _seeds(detect: float, variance: float, comparisons: int, power: float) -> int | None:
    return _fewest(math.log1p(detect) / math.sqrt(2 * max(variance, 1e-12)), ALPHA / comparisons, power)


def _fewest(effect: float, level: float, power: float) -> int | None:
    """By bisection: power grows with the number of seeds."""
    low, high = FEWEST_TO_DECIDE - 1, MOST_SEEDS
    if _power(effect, high, level) < power:
        return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if _power(effect, middle, level) >= power else (middle, high)
    return high


def _power(effect: float, seeds: int, level: float) -> float:
    """Of both tests together. effect: mean over standard deviation of a seed's difference."""
    if seeds < FEWEST_TO_DECIDE:
        return 0.0
    critical = float(stdtrit(seeds - 1, 1 - level / 2))
    if seeds > _COUNTED:
        return float(1 - nctdtr(seeds - 1, min(effect * math.sqrt(seeds), 1e3), critical))
    drawn = _normal(seeds) + effect
    t = drawn.mean(axis=1) / drawn.std(axis=1, ddof=1) * math.sqrt(seeds)
    sums = drawn @ _signs(seeds).T
    swapped = (np.abs(sums) >= sums[:, :1] * (1 - 1e-9)).mean(axis=1)
    return float(((t > critical) & (swapped < ALPHA)).mean())


@lru_cache(maxsize=16)
def _normal(seeds: int) -> FloatArray:
    return np.random.default_rng(seeds).standard_normal((_DRAWS, seeds))


@lru_cache(maxsize=16)
def _signs(seeds: int) -> FloatArray:
    """(2^S, S) every way to swap the two methods' runs, none swapped first."""
    return np.array(list(itertools.product((1.0, -1.0), repeat=seeds)))
