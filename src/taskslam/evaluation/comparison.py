"""Is one method more repeatable than another, here? Comparison on the waypoints that both completed.

The measure of difference is the mean over common waypoints of log(E_a / E_b), whose exponential is a ratio of geometric
means. Its interval is over rounds, for these very waypoints: rounds of either method are jackknifed jointly over all
waypoints (`intervals.py`), and the two variances add, with Welch and Satterthwaite's degrees of freedom.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr, stdtrit

from taskslam.evaluation import intervals
from taskslam.evaluation.metrics_file import Comparison, Interval, RunMetrics
from taskslam.evaluation.permutation import cliffs_delta, exchange_rounds, flip_signs, holm
from taskslam.evaluation.uncertainty import complete_visits
from taskslam.geometry import FloatArray

ALPHA = 0.05
POWER = 0.80
MOST_METHODS = 30
MOST_ROUNDS = 1000
FEWEST_ROUNDS = 4
"""Of each method: 8 rounds can be dealt to two in 35 ways, 6 in only 10, which cannot give p below 0.05."""

MOST_SEQUENCES = 8
SMALLEST = 1e-6
"""Metres. Distances below a micrometre count as one: a logarithm needs a number, and no robot is that repeatable."""

METRICS = ("precision", "accuracy")


def compare_methods(groups: Mapping[str, Sequence[RunMetrics]], metric: str = "precision") -> tuple[Comparison, ...]:
    """Every pair of methods in every mode, with Holm's correction over the pairs of a mode.

    groups: the runs of each method, by the name to show; a pair is compared on the sequences (scenario and seed) that
    both drove. metric: `precision` (E) or `accuracy` (e). In a mode with more than 30 methods nothing is compared.
    """
    found: list[Comparison] = []
    for mode in ("without-map", "with-map"):
        present = {name: [run for run in runs if run.mode == mode] for name, runs in groups.items()}
        names = [name for name, runs in present.items() if runs]
        if len(names) <= MOST_METHODS:
            pairs = itertools.combinations(names, 2)
            found += corrected([compare_pair(a, present[a], b, present[b], metric) for a, b in pairs])
    return tuple(found)


def corrected(comparisons: Sequence[Comparison]) -> list[Comparison]:
    """The same comparisons as one family: adjusted p, and the verdicts that it still allows."""
    tested = [c for c in comparisons if c.p is not None]
    adjusted = iter(holm([c.p for c in tested if c.p is not None]))
    return [_judged(c, next(adjusted), len(tested)) if c.p is not None else c for c in comparisons]


def compare_pair(
    a: str, runs_a: Sequence[RunMetrics], b: str, runs_b: Sequence[RunMetrics], metric: str = "precision"
) -> Comparison:
    """Two methods by their runs of one mode; runs are paired by scenario and seed. Not corrected for other pairs.

    Raises ValueError for an unknown metric.
    """
    if metric not in METRICS:
        raise ValueError(f"unknown metric {metric!r}; expected one of {', '.join(METRICS)}")
    by_key = {(run.scenario, run.seed): run for run in runs_b}
    paired = [(run, by_key[run.scenario, run.seed]) for run in runs_a if (run.scenario, run.seed) in by_key]
    mode = runs_a[0].mode if runs_a else ""
    shared, a_only, b_only = _common(paired)
    if not shared:
        return _empty(metric, mode, a, b, a_only, b_only, paired)
    evidence = _evidence(shared, metric, "|".join((metric, mode, a, b)))
    values_a, values_b = evidence.values_a, evidence.values_b
    return _judged(
        Comparison(
            metric=metric,
            mode=mode,
            a=a,
            b=b,
            waypoints=len(values_a),
            a_only=a_only,
            b_only=b_only,
            rounds=(min(len(pair[0]) for pair in shared), min(len(pair[1]) for pair in shared)),
            a_mean_m=float(values_a.mean()),
            b_mean_m=float(values_b.mean()),
            ratio=math.exp(evidence.difference),
            ratio_interval=evidence.interval(),
            p=evidence.p(),
            p_adjusted=None,
            p_permutation=evidence.permutation[0],
            p_permutation_floor=evidence.permutation[1],
            cliffs_delta=cliffs_delta(values_a, values_b),
            better_at=int((values_a < values_b).sum()),
            told_apart=False,
            rounds_needed=evidence.rounds_needed(),
            verdict="",
        ),
        evidence.p(),
        1,
    )


Shared = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True)
class _Evidence:
    """values: E or e at the common waypoints, m. difference: mean log ratio; variance: over rounds, with its freedom.

    per_round: variance that one round of each method would have.
    """

    values_a: FloatArray
    values_b: FloatArray
    difference: float
    variance: float | None
    freedom: float
    per_round: float
    permutation: tuple[float, float]

    def interval(self) -> Interval | None:
        if self.variance is None:
            return None
        half = min(intervals.quantile(1 - ALPHA, self.freedom) * math.sqrt(self.variance), 300.0)
        return Interval(low=math.exp(self.difference - half), high=math.exp(self.difference + half))

    def p(self) -> float | None:
        if self.variance is None:
            return None
        if self.variance == 0:
            return 1.0 if self.difference == 0 else 0.0
        return float(2 * stdtr(self.freedom, -abs(self.difference) / math.sqrt(self.variance)))

    def rounds_needed(self) -> int | None:
        """Smallest M at which a t test at 5 % finds this difference in 80 % of the cases."""
        if self.variance is None or self.difference == 0:
            return None
        M = np.arange(3, MOST_ROUNDS + 1)
        shift = stdtrit(2 * M - 2, 1 - ALPHA / 2) + stdtrit(2 * M - 2, POWER)
        enough = shift * np.sqrt(self.per_round / M) <= abs(self.difference)
        return max(int(M[np.argmax(enough)]), FEWEST_ROUNDS) if enough.any() else None


def _common(paired: Sequence[tuple[RunMetrics, RunMetrics]]) -> tuple[list[Shared], int, int]:
    """(M_a, N, 3) and (M_b, N, 3) visits and (N, 3) goals of what both completed; how many waypoints only one did."""
    shared, a_only, b_only = [], 0, 0
    for first, second in paired:
        done_a = {w.goal for w in first.waypoints if w.complete}
        done_b = {w.goal for w in second.waypoints if w.complete}
        a_only, b_only = a_only + len(done_a - done_b), b_only + len(done_b - done_a)
        goals = sorted(done_a & done_b)
        visits_a, visits_b = complete_visits(first, goals), complete_visits(second, goals)
        if goals and visits_a is not None and visits_b is not None and min(len(visits_a), len(visits_b)) > 1:
            shared.append((visits_a, visits_b, np.array([first.waypoints[goal].target for goal in goals])))
    return shared, a_only, b_only


def _evidence(shared: Sequence[Shared], metric: str, seed: str) -> _Evidence:
    measure = _spreads if metric == "precision" else _offsets
    logs = [(measure(a, goals), measure(b, goals)) for a, b, goals in shared]
    difference = float(np.concatenate([a[0] - b[0] for a, b in logs]).mean())
    values = [np.concatenate([_values(trio[side], trio[2], metric) for trio in shared]) for side in (0, 1)]
    enough = all(min(len(a), len(b)) >= 3 for a, b, _ in shared)
    parts = [intervals.two_way_variance([pair[side][1] for pair in logs]) for side in (0, 1)] if enough else []
    variance = sum(part.rounds for part in parts)
    squared = sum(part.rounds**2 / part.rounds_freedom for part in parts if part.rounds > 0)
    per_round = 0.0
    for side, part in enumerate(parts):
        per_round += part.rounds * float(np.mean([len(pair[side]) for pair in shared]))
    return _Evidence(
        values_a=values[0],
        values_b=values[1],
        difference=difference,
        variance=variance if enough else None,
        freedom=variance**2 / squared if squared else math.inf,
        per_round=per_round,
        permutation=_permutation(shared, logs, metric, seed),
    )


def _values(visits: FloatArray, goals: FloatArray, metric: str) -> FloatArray:
    """(N,) E or e as they stand in the tables, m."""
    return intervals.mean_distance(visits[..., :2]) if metric == "precision" else _distances(visits, goals).mean(axis=0)


def _spreads(visits: FloatArray, _goals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(N,) log E, freed of its bias, and its (M, N) pseudo-values (the values themselves below three rounds)."""
    bias = intervals.precision_bias(len(visits))
    whole = _log(intervals.mean_distance(visits[..., :2]) / bias)
    if len(visits) < 3:
        return whole, np.tile(whole, (len(visits), 1))
    return whole, intervals.pseudo_values(whole, _log(intervals.without_each_round(visits[..., :2]) / bias))


def _offsets(visits: FloatArray, goals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(N,) log e, and its (M, N) pseudo-values."""
    M, distances = len(visits), _distances(visits, goals)
    whole = _log(distances.mean(axis=0))
    return whole, intervals.pseudo_values(whole, _log((distances.sum(axis=0) - distances) / (M - 1)))


def _permutation(
    shared: Sequence[Shared], logs: Sequence[tuple[tuple[FloatArray, FloatArray], ...]], metric: str, seed: str
) -> tuple[float, float]:
    """Rounds are exchanged within each sequence; with many sequences, whole runs are, which costs less."""
    if len(shared) > MOST_SEQUENCES:
        return flip_signs(np.array([float((a[0] - b[0]).sum()) for a, b in logs]), seed)
    if metric == "precision":
        centred = [((a - a.mean(axis=0))[..., :2], (b - b.mean(axis=0))[..., :2]) for a, b, _ in shared]
        return exchange_rounds(centred, _log_ratio_of_spreads, seed)
    away = [
        tuple(np.hypot(*(visits - goals)[..., :2].transpose(2, 0, 1)) for visits in (a, b)) for a, b, goals in shared
    ]
    return exchange_rounds([(a, b) for a, b in away], _log_ratio_of_means, seed)


def _log_ratio_of_spreads(a: FloatArray, b: FloatArray) -> FloatArray:
    own = [_log(intervals.mean_distance(side) / intervals.precision_bias(side.shape[1])) for side in (a, b)]
    return np.asarray((own[0] - own[1]).sum(axis=-1))


def _log_ratio_of_means(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray((_log(a.mean(axis=1)) - _log(b.mean(axis=1))).sum(axis=-1))


def _distances(visits: FloatArray, goals: FloatArray) -> FloatArray:
    """(M, N) distances of arrivals to their goals, m."""
    return np.asarray(np.hypot(visits[..., 0] - goals[:, 0], visits[..., 1] - goals[:, 1]))


def _log(values: FloatArray) -> FloatArray:
    return np.log(np.maximum(values, SMALLEST))


def _empty(
    metric: str, mode: str, a: str, b: str, a_only: int, b_only: int, paired: Sequence[tuple[RunMetrics, RunMetrics]]
) -> Comparison:
    why = "completed by both in more than one round" if paired else "driven by both"
    return Comparison(
        metric=metric, mode=mode, a=a, b=b, waypoints=0, a_only=a_only, b_only=b_only, rounds=(0, 0), a_mean_m=None,
        b_mean_m=None, ratio=None, ratio_interval=None, p=None, p_adjusted=None, p_permutation=None,
        p_permutation_floor=None, cliffs_delta=None, better_at=0, told_apart=False, rounds_needed=None,
        verdict=f"{a} and {b} cannot be compared: no waypoint was {why}.",
    )  # fmt: skip


def _judged(comparison: Comparison, p_adjusted: float | None, comparisons: int) -> Comparison:
    """With the adjusted p, and the verdict in a sentence. Told apart: if both tests say so, t after the correction."""
    apart = (
        p_adjusted is not None
        and p_adjusted < ALPHA
        and comparison.p_permutation is not None
        and comparison.p_permutation < ALPHA
    )
    told = comparison.model_copy(update={"p_adjusted": p_adjusted, "told_apart": apart})
    return told.model_copy(update={"verdict": _verdict(told, comparisons)})


def _verdict(c: Comparison, comparisons: int) -> str:
    assert c.a_mean_m is not None
    assert c.b_mean_m is not None
    assert c.ratio is not None
    better_first = c.ratio <= 1 or not c.told_apart
    (one, x), (other, y) = sorted(
        [(c.a, c.a_mean_m), (c.b, c.b_mean_m)], key=lambda item: (item[0] != c.a) == better_first
    )
    sizes = f"{100 * x:.2g} against {100 * y:.2g} cm at {c.waypoints} common waypoints"
    if c.ratio_interval is None or c.p_adjusted is None:
        return f"{min(c.rounds)} rounds cannot tell {one} from {other}: {sizes}."
    ends = [c.ratio, c.ratio_interval.low, c.ratio_interval.high]
    if not better_first:
        ends = [1 / ends[0], 1 / ends[2], 1 / ends[1]]
    family = f" corrected for {comparisons} comparisons" if comparisons > 1 else ""
    p = "p < 0.001" if c.p_adjusted < 0.001 else f"p = {c.p_adjusted:.2g}"
    numbers = f"{sizes}, ratio {ends[0]:.2f} [{ends[1]:.2f}, {ends[2]:.2f}], {p}{family}"
    if c.told_apart:
        word = "more repeatable" if c.metric == "precision" else "more accurate"
        return f"{one} is {word} than {other} here: {numbers}."
    return f"The data do not tell {one} from {other}: {numbers}.{_what_is_missing(c)}"


def _what_is_missing(c: Comparison) -> str:
    if c.p_permutation_floor is not None and c.p_permutation_floor >= ALPHA:
        return f" {min(c.rounds)} rounds are too few: dealt out by chance, they cannot give p below {ALPHA:g}."
    return f" About {c.rounds_needed} rounds each would settle it." if c.rounds_needed else ""
