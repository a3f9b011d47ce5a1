"""What the arrivals of two methods say about the difference between them, in numbers (`comparison.py` judges it)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr, stdtrit

from taskslam.evaluation import intervals
from taskslam.evaluation.metrics_file import Interval, RunMetrics
from taskslam.evaluation.missing import column_mean, filled, known_rounds
from taskslam.evaluation.permutation import exchange_rounds, flip_signs
from taskslam.evaluation.seeds import Place, seed_table, spread
from taskslam.evaluation.uncertainty import complete_visits
from taskslam.geometry import FloatArray

ALPHA = 0.05
POWER = 0.80
MOST_ROUNDS = 1000
FEWEST_ROUNDS = 4
"""Of each method: 8 rounds can be dealt to two in 35 ways, 6 in only 10, which cannot give p below 0.05."""

MOST_SEQUENCES = 8
"""With more than these, whole runs are dealt out rather than rounds, which costs less."""

SMALLEST = 1e-6
"""Metres. Distances below a micrometre count as one: a logarithm needs a number, and no robot is that repeatable."""


@dataclass(frozen=True)
class Side:
    """One run at some of its waypoints. visits: (M, N, 3), NaN where the measurement lost one; targets: (N, 3).

    values: (N,) E or e in metres; logs: their logarithms, E freed of the bias of few rounds; variance: of the mean of
    the logs, due to the rounds; None below three rounds.
    """

    visits: FloatArray
    targets: FloatArray
    values: FloatArray
    logs: FloatArray
    variance: float | None

    @property
    def rounds(self) -> int:
        """M."""
        return len(self.visits)


class Sides:
    """The sides of many pairs, each run measured once for every set of waypoints. metric: `precision` or `accuracy`."""

    def __init__(self, metric: str) -> None:
        """Nothing is measured yet."""
        self.metric = metric
        self._complete: dict[int, tuple[RunMetrics, frozenset[int]]] = {}
        self._sides: dict[tuple[int, frozenset[int]], Side | None] = {}

    def complete(self, run: RunMetrics) -> frozenset[int]:
        """Goal indices of the complete waypoints."""
        if id(run) not in self._complete:  # the run is kept, so no other can take over its id
            self._complete[id(run)] = run, frozenset(w.goal for w in run.waypoints if w.complete)
        return self._complete[id(run)][1]

    def side(self, run: RunMetrics, goals: frozenset[int]) -> Side | None:
        """The run at these waypoints; None without a waypoint, below two rounds, or if a true pose is not known."""
        key = (id(run), goals)
        if key not in self._sides:
            self._sides[key] = _side(run, sorted(goals), self.metric)
        return self._sides[key]


@dataclass(frozen=True)
class Evidence:
    """values: E or e at the common waypoints, m. difference: mean log ratio; variance: over rounds, with its freedom.

    per_round: variance that one round of each method would have; 0 over seeds. permutation: p, and the smallest p
    possible. seeds: that the variance is over; with one, it is over rounds.
    """

    values_a: FloatArray
    values_b: FloatArray
    difference: float
    variance: float | None
    freedom: float
    per_round: float
    permutation: tuple[float, float]
    seeds: int = 1

    def interval(self) -> Interval | None:
        """Of the ratio, exp(difference)."""
        if self.variance is None:
            return None
        half = min(float(intervals.quantile(1 - ALPHA, self.freedom)) * math.sqrt(self.variance), 300.0)
        return Interval(low=intervals.ratio_of(self.difference - half), high=intervals.ratio_of(self.difference + half))

    def p(self) -> float | None:
        """Of a difference as large as this by chance: two-sided t test."""
        if self.variance is None:
            return None
        if self.variance == 0:
            return 1.0 if self.difference == 0 else 0.0
        freedom = min(self.freedom, 1e9)
        return float(2 * stdtr(freedom, -abs(self.difference) / math.sqrt(self.variance)))

    def rounds_needed(self) -> int | None:
        """Smallest M at which a t test at 5 % finds this difference in 80 % of the cases."""
        if self.variance is None or self.difference == 0 or self.seeds > 1:
            return None
        M = np.arange(3, MOST_ROUNDS + 1)
        shift = stdtrit(2 * M - 2, 1 - ALPHA / 2) + stdtrit(2 * M - 2, POWER)
        enough = shift * np.sqrt(self.per_round / M) <= abs(self.difference)
        return max(int(M[np.argmax(enough)]), FEWEST_ROUNDS) if enough.any() else None


def weigh(pairs: Sequence[tuple[Side, Side]], metric: str, seed: str) -> Evidence:
    """The evidence of one or more sequences, each waypoint with weight 1. seed: text that seeds random deals."""
    waypoints = sum(len(a.values) for a, _ in pairs)
    variance = squared = per_round = 0.0
    for pair in pairs:
        for side in pair:
            part = (side.variance or 0.0) * (len(side.values) / waypoints) ** 2
            variance += part
            squared += part**2 / (side.rounds - 1)
            per_round += part * side.rounds
    return Evidence(
        values_a=np.concatenate([a.values for a, _ in pairs]),
        values_b=np.concatenate([b.values for _, b in pairs]),
        difference=math.fsum(float((a.logs - b.logs).sum()) for a, b in pairs) / waypoints,
        variance=variance if all(side.variance is not None for pair in pairs for side in pair) else None,
        freedom=variance**2 / squared if squared else math.inf,
        per_round=per_round,
        permutation=_permutation(pairs, metric, seed),
    )


def weigh_seeds(pairs: Sequence[tuple[int, Sequence[Place], Side, Side]], seed: str) -> Evidence:
    """The evidence of at least two seeds, each waypoint of each seed with weight 1: rounds nest in seeds (`seeds.py`).

    pairs: a seed, the waypoints of its sides, and these. seed: text that seeds random swaps.
    """
    table = seed_table(
        (own, place, (difference,))
        for own, places, a, b in pairs
        for place, difference in zip(places, a.logs - b.logs, strict=True)
    )
    sure = spread(table)
    return Evidence(
        values_a=np.concatenate([a.values for *_, a, _ in pairs]),
        values_b=np.concatenate([b.values for *_, b in pairs]),
        difference=float(sure.mean[0]),
        variance=float(sure.seeds[0]),
        freedom=sure.freedom[0],
        per_round=0.0,
        permutation=flip_signs(np.nansum(table[0], axis=1), seed),
        seeds=table.shape[1],
    )


def _side(run: RunMetrics, goals: Sequence[int], metric: str) -> Side | None:
    comparable = metric == "precision" or run.truth_frame == "map"
    visits = complete_visits(run, goals) if goals and comparable else None
    if visits is None or len(visits) < 2:
        return None
    targets = np.array([run.waypoints[goal].target for goal in goals])
    M = len(visits)
    if metric == "precision":
        values, bias = intervals.mean_distance(visits[..., :2]), intervals.precision_bias(M)
        without = intervals.without_each_round(visits[..., :2]) / bias if M > 2 else None
    else:
        distances, bias = _distances(visits, targets), 1.0
        known, total = known_rounds(distances, axis=0), np.nansum(distances, axis=0)
        values = total / known
        without = (total - distances) / (known - 1)
    logs = _log(values / bias)
    if without is None or M < 3:
        return Side(visits, targets, values, logs, None)
    table = filled(intervals.pseudo_values(logs, _log(without)))
    variance = None if table is None else float(intervals.two_way_variance([table]).rounds)
    return Side(visits, targets, values, logs, variance)


def _permutation(pairs: Sequence[tuple[Side, Side]], metric: str, seed: str) -> tuple[float, float]:
    """Rounds are exchanged within each sequence; with many sequences, whole runs are."""
    if len(pairs) > MOST_SEQUENCES:
        return flip_signs(np.array([float((a.logs - b.logs).sum()) for a, b in pairs]), seed)
    if metric == "precision":
        return exchange_rounds([(_centred(a), _centred(b)) for a, b in pairs], _log_ratio_of_spreads, seed)
    away = [(_distances(a.visits, a.targets), _distances(b.visits, b.targets)) for a, b in pairs]
    return exchange_rounds(away, _log_ratio_of_means, seed)


def _centred(side: Side) -> FloatArray:
    """(M, N, 2) positions about their means: two methods alike in scatter may stop at different places."""
    return np.asarray((side.visits - column_mean(side.visits, axis=0))[..., :2])


# Dealt to a method by chance, a waypoint may be left with too few visits. It says nothing then: a log ratio of 0.


def _log_ratio_of_spreads(a: FloatArray, b: FloatArray) -> FloatArray:
    own = [_log(intervals.mean_distance(side) / intervals.precision_bias(side.shape[1])) for side in (a, b)]
    return np.asarray(np.nansum(own[0] - own[1], axis=-1))


def _log_ratio_of_means(a: FloatArray, b: FloatArray) -> FloatArray:
    means = [column_mean(side, axis=1)[:, 0] for side in (a, b)]
    return np.asarray(np.nansum(_log(means[0]) - _log(means[1]), axis=-1))


def _distances(visits: FloatArray, targets: FloatArray) -> FloatArray:
    """(M, N) distances of arrivals to their goals, m."""
    return np.asarray(np.hypot(visits[..., 0] - targets[:, 0], visits[..., 1] - targets[:, 1]))


def _log(values: FloatArray) -> FloatArray:
    return np.log(np.maximum(values, SMALLEST))
