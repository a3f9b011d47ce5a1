"""Until decided: comparisons of methods that may be looked at after every seed, and stopped whenever they tell.

A test at 5 % that is repeated after every seed calls alike methods different in far more than 5 % of all campaigns. An
e-process does not: a player bets against "the two methods are alike", and under this hypothesis no stopping rule makes
the expected wealth larger than 1. Let d_s be the difference of two methods in seed s, such as log(E_a / E_b) over
common waypoints. If the methods are alike, swapping their runs of a seed changes nothing, so that the sign of d_s is a
fair coin whatever its size. With any lambda in [-1, 1] that depends on earlier seeds and on |d_s|,

    W_S = prod_s (1 + lambda_s sign(d_s)),   E[W] <= 1 at every stopping time,

so P(W ever reaches 1 / alpha) <= alpha (Ville 1939; betting: Waudby-Smith, Ramdas, J. Royal Stat. Soc. B 86, 2024;
tests of symmetry: Vovk, Wang, New England J. Stat. Data Science, 2024). Nothing is assumed of the distribution. The bet

    lambda_s = tanh(r |d_s| / q_s),   q_s^2 = mean of d_1^2 .. d_s^2,

is the best one against a normal shift whose mean times root mean square over variance is r (the odds of the two signs
are then exp(2 r |d_s| / q_s)); the wealth is the average over `_BETS` and over both signs. As for any e-process, 1 over
the largest wealth so far is a p-value that holds at all times together, so Holm's correction applies to several pairs.
Six seeds at least are needed at 5 %. Robots' policies are compared to the same end in arXiv 2503.10966.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from taskslam.evaluation.metrics_file import Interval, RunMetrics
from taskslam.evaluation.permutation import holm
from taskslam.geometry import FloatArray

ALPHA = 0.05
_BETS = (0.5, 2.0, 16.0)
_GRID = 401  # shifts among which the interval is looked for


def wealth(differences: npt.ArrayLike) -> FloatArray:
    """(..., S) wealth after each seed of the bets against symmetry about 0, from (..., S) differences.

    NaN, a seed in which the two cannot be compared, and 0 leave the wealth as it is.
    """
    return np.asarray(_wealth_of_sides(differences).mean(axis=0))


def _wealth_of_sides(differences: npt.ArrayLike) -> FloatArray:
    """(2, ..., S): of the bets that differences are positive, and negative."""
    d = np.nan_to_num(np.asarray(differences, dtype=np.float64))
    seen = np.cumsum(d != 0, axis=-1)
    size = np.sqrt(np.cumsum(d**2, axis=-1) / np.maximum(seen, 1))
    ratio = np.abs(d) / np.where(size > 0, size, 1.0)
    stakes = np.array([np.tanh(r * ratio) * np.sign(d) for r in _BETS])
    with np.errstate(divide="ignore"):  # who stakes all and loses has nothing left
        sides = [np.exp(np.cumsum(np.log1p(side * stakes), axis=-1)).mean(axis=0) for side in (1.0, -1.0)]
    return np.array(sides)


def p_at_any_time(differences: npt.ArrayLike) -> FloatArray:
    """(...,) p-values of (..., S) differences that hold however often one looks: 1 over the largest wealth so far."""
    return np.asarray(1 / np.maximum(wealth(differences).max(axis=-1, initial=1.0), 1.0))


def shift_interval(differences: Sequence[float], level: float = 1 - ALPHA) -> Interval | None:
    """The shifts that no bet has refuted so far: an interval for the centre of the differences, valid at all times.

    None while every shift is possible.
    """
    d = np.array([one for one in differences if not math.isnan(one)])
    if len(d) < 2:
        return None
    reach = 4 * max(float(np.ptp(d)), 1e-9)
    grid = np.linspace(d.min() - reach, d.max() + reach, _GRID)
    step = float(grid[1] - grid[0])
    possible = grid[p_at_any_time(d[None, :] - grid[:, None]) > 1 - level]
    if not len(possible) or possible[0] == grid[0] or possible[-1] == grid[-1]:
        return None
    return Interval(low=float(possible[0]) - step, high=float(possible[-1]) + step)


@dataclass(frozen=True)
class Pair:
    """Two methods so far. better: the one with the smaller values, where the data tell, else None.

    ratio: exp of the centre of the differences, b over a below 1 means that b is smaller; interval: valid at all times.
    """

    a: str
    b: str
    seeds: int
    p_adjusted: float
    better: str | None
    ratio: float | None
    interval: Interval | None


@dataclass(frozen=True)
class Decision:
    """What a campaign that compares methods knows so far.

    best: the method that is better than every other, once the data tell. decided: whether nothing is open that was
    asked for.
    """

    pairs: tuple[Pair, ...]
    best: str | None
    decided: bool

    @property
    def open(self) -> tuple[Pair, ...]:
        """Pairs that are not told apart."""
        return tuple(pair for pair in self.pairs if pair.better is None)

    @property
    def words(self) -> str:
        """In a sentence."""
        if self.best is not None and self.decided:
            return f"Decided: {self.best} is the most repeatable (5 % over all looks together)."
        told = len(self.pairs) - len(self.open)
        return f"{told} of {len(self.pairs)} pairs are told apart (5 % over all looks together)."


def decide(
    values: Mapping[str, Sequence[float]], *, all_pairs: bool = False, alpha: float = ALPHA, alike: float | None = None
) -> Decision:
    """Compare two or more methods on the seeds so far, in the order in which they were driven.

    values: for each method one logarithm a seed, such as the mean log E over the waypoints that all completed; NaN
    where there is none. A campaign may stop once `decided`: the best is told from every other, or, with `all_pairs`,
    each pair is. alike: a log ratio within which two methods count as alike, so that their pair is settled too.

    The chance that any pair of methods that are alike is ever told apart is at most alpha. Raises ValueError for fewer
    than two methods, or values of different length.
    """
    if len(values) < 2 or len({len(own) for own in values.values()}) != 1:
        raise ValueError("expected at least two methods with one value for each seed")
    found = []
    for a, b in combinations(values, 2):
        d = np.asarray(values[b], dtype=np.float64) - np.asarray(values[a], dtype=np.float64)
        found.append((a, b, d, float(p_at_any_time(d))))
    adjusted = holm([p for *_, p in found])
    pairs, settled = [], set()
    for (a, b, d, _), p in zip(found, adjusted, strict=True):
        known = d[~np.isnan(d)]
        interval = shift_interval(known.tolist(), 1 - alpha / len(found))
        larger, smaller = _wealth_of_sides(d).max(axis=-1, initial=0.0)
        better = None if p > alpha else a if larger > smaller else b
        if better is not None or (alike and interval and max(abs(interval.low), abs(interval.high)) <= alike):
            settled.add((a, b))
        pairs.append(
            Pair(
                a,
                b,
                len(known),
                p,
                better,
                math.exp(float(np.median(known))) if len(known) else None,
                interval and Interval(low=math.exp(interval.low), high=math.exp(interval.high)),
            )
        )
    wins = {name: sum(pair.better == name for pair in pairs) for name in values}
    best = next((name for name, won in wins.items() if won == len(values) - 1), None)
    return Decision(tuple(pairs), best, len(settled) == len(pairs) or (best is not None and not all_pairs))


def log_precisions(runs: Mapping[str, Sequence[RunMetrics]]) -> dict[str, list[float]]:
    """What `decide` compares: each method's mean log E, in each seed that all drove, over waypoints that all completed.

    runs: of each method, in one mode. Seeds in their order; NaN where no waypoint was completed by all.
    """
    by_seed = {name: _by_seed(own) for name, own in runs.items()}
    seeds = sorted(set[int].intersection(*(set(own) for own in by_seed.values()))) if by_seed else []
    found: dict[str, list[float]] = {name: [] for name in runs}
    for seed in seeds:
        common = set[tuple[str, int]].intersection(*(set(own[seed]) for own in by_seed.values()))
        for name, own in by_seed.items():
            logs = [math.log(max(own[seed][place], 1e-6)) for place in sorted(common)]
            found[name].append(math.fsum(logs) / len(logs) if logs else math.nan)
    return found


def _by_seed(runs: Sequence[RunMetrics]) -> dict[int, dict[tuple[str, int], float]]:
    """E at each complete waypoint, by seed."""
    found: dict[int, dict[tuple[str, int], float]] = {}
    for run in runs:
        own = found.setdefault(run.seed, {})
        for waypoint in run.waypoints:
            if waypoint.complete and waypoint.position.precision_m is not None:
                own[run.scenario, waypoint.goal] = waypoint.position.precision_m
    return found
