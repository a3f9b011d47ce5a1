"""Which method for my robot? Sequential elimination over seeds, until one is the best with the wanted probability.

What counts is the share of planned arrivals within a tolerance of their waypoint's mean pose (`tolerance.py`); of
methods whose shares differ by less than a margin, the one that takes the least processor time (an indifference zone:
Bechhofer, Ann. Math. Statistics 25, 1954). In each seed a method has h of n arrivals, on a scale where their scatter is
alike (Anscombe, Biometrika 35, 1948)

    phi = asin sqrt((h + 3/8) / (n + 3/4)).

Its variance between seeds is estimated from few of them, so each method's own, s_k^2 with S - 1 degrees of freedom, is
shrunk towards what all have in common with 4 (Smyth, Statistical Applications in Genetics 3, 2004), and is never below
that of n independent arrivals, 1 / 4n. The probability of being the best is that among draws of phi_k from Student's t
about its mean with these variances. A method is dropped as soon as that is below 1 %. Unlike the sequence of bets in
`sequential.py` this assumes the normal distribution; how often the method that it names is the best, or within the
margin, is measured in `tests/evaluation/test_choice.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from taskslam.evaluation.metrics_file import RunMetrics
from taskslam.evaluation.tolerance import arrival_spread
from taskslam.geometry import FloatArray

MARGIN = 0.02
SURE, HOPELESS = 0.95, 0.01
FEWEST_SEEDS = 2
_PRIOR = 4  # degrees of freedom of what methods have in common
_DRAWS = 10_000


@dataclass(frozen=True)
class Score:
    """A method in one seed. hits: arrivals within tolerance, of those planned; cost: cores that it keeps busy."""

    hits: int
    planned: int
    cost: float


@dataclass(frozen=True)
class Standing:
    """A method so far. share: of arrivals within tolerance; probability: of being the one to choose.

    dropped: whether it is driven no more.
    """

    method: str
    seeds: int
    share: float
    cost: float
    probability: float
    dropped: bool = False


def score_of(runs: Sequence[RunMetrics], position_m: float, heading_rad: float = math.inf) -> Score:
    """The score of a method's runs of one seed at all places. Raises ValueError for no run."""
    if not runs:
        raise ValueError("no run to score; expected at least one")
    spread = arrival_spread(runs)
    hits = int(((spread.distances <= position_m) & (spread.angles <= heading_rad)).sum())
    simulated = math.fsum(run.simulated_s for run in runs)
    busy = math.fsum(run.compute_s for run in runs)
    return Score(hits, spread.planned, busy / simulated if simulated > 0 else 0.0)


def standings(scores: Mapping[str, Sequence[Score]], margin: float = MARGIN) -> tuple[Standing, ...]:
    """Methods by their probability of being the one to choose, the likeliest first. scores: of each, one a seed.

    With one seed the variance between seeds is not known, and every probability is that of a guess.
    """
    names = sorted(scores)
    share = np.array(
        [sum(s.hits for s in scores[name]) / max(sum(s.planned for s in scores[name]), 1) for name in names]
    )
    cost = np.array([np.mean([s.cost for s in scores[name]]) for name in names])
    fewest = min(len(own) for own in scores.values())
    chance = np.full(len(names), 1 / len(names)) if fewest < FEWEST_SEEDS else _chances(scores, names, cost, margin)
    found = [
        Standing(name, len(scores[name]), float(own), float(takes), float(p))
        for name, own, takes, p in zip(names, share, cost, chance, strict=True)
    ]
    return tuple(sorted(found, key=lambda one: (-one.probability, -one.share, one.cost, one.method)))


def race(
    methods: Sequence[str],
    drive: Callable[[Sequence[str], int], Mapping[str, Score]],
    *,
    most_seeds: int = 20,
    margin: float = MARGIN,
    sure: float = SURE,
) -> Iterator[tuple[Standing, ...]]:
    """The standings after each seed, until one method is sure enough, alone, or the seeds are used up.

    drive: the scores of these methods in a seed; a method that it leaves out is driven no more. Whoever has had enough
    stops iterating.
    """
    scores: dict[str, list[Score]] = {name: [] for name in methods}
    dropped: dict[str, Standing] = {}
    left = list(methods)
    for seed in range(most_seeds):
        found = drive(tuple(left), seed)
        left = [name for name in left if name in found]
        if not left:
            return
        for name in left:
            scores[name].append(found[name])
        now = standings({name: scores[name] for name in left}, margin)
        if seed + 1 >= FEWEST_SEEDS:
            out = [one for one in now if one.probability < HOPELESS]
            dropped |= {one.method: replace(one, dropped=True) for one in out}
            left = [name for name in left if name not in dropped]
        yield (*(one for one in now if one.method not in dropped), *dropped.values())
        if len(left) == 1 or (seed + 1 >= FEWEST_SEEDS and now[0].probability >= sure):
            return


def _chances(
    scores: Mapping[str, Sequence[Score]], names: Sequence[str], cost: FloatArray, margin: float
) -> FloatArray:
    """(K,) probability of each method of being the cheapest within the margin of the best."""
    own = [np.array([_angle(score) for score in scores[name]]) for name in names]
    seeds = np.array([len(values) for values in own])
    spread = np.array([values.var(ddof=1) for values in own])
    floor = np.array([np.mean([1 / (4 * max(s.planned, 1)) for s in scores[name]]) for name in names])
    common = float(((seeds - 1) * spread).sum() / (seeds - 1).sum())
    variance = np.maximum((_PRIOR * common + (seeds - 1) * spread) / (_PRIOR + seeds - 1), floor)
    random = np.random.default_rng(0)
    t = np.stack([random.standard_t(_PRIOR + count - 1, _DRAWS) for count in seeds], axis=1)
    drawn = np.array([values.mean() for values in own]) + t * np.sqrt(variance / seeds)
    share = np.sin(np.clip(drawn, 0.0, math.pi / 2)) ** 2
    good = share >= share.max(axis=1, keepdims=True) - margin
    chosen = np.where(good, cost, np.inf).argmin(axis=1)
    return np.bincount(chosen, minlength=len(names)) / _DRAWS


def _angle(score: Score) -> float:
    return math.asin(math.sqrt((score.hits + 3 / 8) / (score.planned + 3 / 4)))
