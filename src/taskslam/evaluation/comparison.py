"""Is one method more repeatable than another, here? Comparison on the waypoints that both completed.

The measure of difference is the mean over common waypoints of log(E_a / E_b), whose exponential is a ratio of
geometric means. Its interval is for these very waypoints. Of one seed it is over rounds: rounds of either method are
jackknifed jointly over all waypoints (`intervals.py`), and the two variances add, with Welch and Satterthwaite's
degrees of freedom. Of several seeds it is over seeds, paired, in which their rounds are contained (`seeds.py`); fewer
than six describe and decide nothing.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

from taskslam.evaluation import intervals
from taskslam.evaluation.evidence import ALPHA, Evidence, Side, Sides, weigh, weigh_seeds
from taskslam.evaluation.metrics_file import Comparison, RunMetrics
from taskslam.evaluation.permutation import cliffs_delta, holm
from taskslam.evaluation.power import seeds_needed
from taskslam.evaluation.seeds import FEWEST_TO_DECIDE, several_seeds
from taskslam.mode import Mode

MOST_METHODS = 30
METRICS = ("precision", "accuracy")


def compare_methods(groups: Mapping[str, Sequence[RunMetrics]], metric: str = "precision") -> tuple[Comparison, ...]:
    """Every pair of methods in every mode, with Holm's correction over the pairs of a mode.

    groups: the runs of each method, by the name to show; a pair is compared on the sequences (scenario and seed) that
    both drove. metric: `precision` (E) or `accuracy` (e). In a mode with more than 30 methods nothing is compared.
    """
    found: list[Comparison] = []
    sides = Sides(metric)
    for mode in Mode:
        present = {name: [run for run in runs if run.mode == mode] for name, runs in groups.items()}
        names = [name for name, runs in present.items() if runs]
        if len(names) <= MOST_METHODS:
            pairs = itertools.combinations(names, 2)
            found += corrected([_compare(a, present[a], b, present[b], sides) for a, b in pairs])
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

    Over rounds, also of several seeds: for these very seeds, as a gate asks that drives the same ones again. Raises
    ValueError for an unknown metric.
    """
    return _compare(a, runs_a, b, runs_b, Sides(metric), over_seeds=False)


def _compare(
    a: str,
    runs_a: Sequence[RunMetrics],
    b: str,
    runs_b: Sequence[RunMetrics],
    sides: Sides,
    over_seeds: bool = True,
) -> Comparison:
    metric = sides.metric
    if metric not in METRICS:
        raise ValueError(f"unknown metric {metric!r}; expected one of {', '.join(METRICS)}")
    by_key = {(run.scenario, run.seed): run for run in runs_b}
    paired = [(run, by_key[run.scenario, run.seed]) for run in runs_a if (run.scenario, run.seed) in by_key]
    mode = runs_a[0].mode if runs_a else ""
    shared: list[tuple[RunMetrics, frozenset[int], Side, Side]] = []
    a_only = b_only = 0
    for first, second in paired:
        done_a, done_b = sides.complete(first), sides.complete(second)
        a_only, b_only = a_only + len(done_a - done_b), b_only + len(done_b - done_a)
        both = done_a & done_b
        side_a, side_b = sides.side(first, both), sides.side(second, both)
        if side_a is not None and side_b is not None:
            shared.append((first, both, side_a, side_b))
    if not shared:
        return _empty(metric, mode, a, b, a_only, b_only, paired)
    evidence = _evidence(shared, metric, "|".join((metric, mode, a, b)), over_seeds)
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
            rounds=(min(side.rounds for *_, side, _ in shared), min(side.rounds for *_, side in shared)),
            a_mean_m=float(values_a.mean()),
            b_mean_m=float(values_b.mean()),
            ratio=intervals.ratio_of(evidence.difference),
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
            seeds=len({run.seed for run, *_ in shared}),
            over_seeds=evidence.seeds > 1,
            seeds_needed=_seeds_needed(evidence),
        ),
        evidence.p(),
        1,
    )


def _evidence(
    shared: Sequence[tuple[RunMetrics, frozenset[int], Side, Side]], metric: str, seed: str, over_seeds: bool
) -> Evidence:
    if over_seeds and several_seeds((run.scenario, run.seed) for run, *_ in shared):
        places = [[(run.scenario, goal) for goal in sorted(goals)] for run, goals, *_ in shared]
        return weigh_seeds([(run.seed, own, a, b) for (run, _, a, b), own in zip(shared, places, strict=True)], seed)
    return weigh([(a, b) for *_, a, b in shared], metric, seed)


def _seeds_needed(evidence: Evidence) -> int | None:
    if evidence.seeds == 1 or evidence.variance is None:
        return None
    return seeds_needed(evidence.difference, (evidence.variance * evidence.seeds) ** 0.5)


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
        (not comparison.over_seeds or comparison.seeds >= FEWEST_TO_DECIDE)
        and p_adjusted is not None
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
    sizes = f"{100 * x:.2g} against {100 * y:.2g} cm at {c.waypoints} common waypoints, {_of_seeds(c)}"
    if c.ratio_interval is None or c.p_adjusted is None:
        return f"{min(c.rounds)} rounds cannot tell {one} from {other}: {sizes}."
    ends = [c.ratio, c.ratio_interval.low, c.ratio_interval.high]
    if not better_first:
        ends = [1 / ends[0], 1 / ends[2], 1 / ends[1]]
    family = f" corrected for {comparisons} comparisons" if comparisons > 1 else ""
    p = "p < 0.001" if c.p_adjusted < 0.001 else f"p = {c.p_adjusted:.2g}"
    ratio = f"{sizes}, ratio {ends[0]:.2f} [{ends[1]:.2f}, {ends[2]:.2f}]"
    if c.over_seeds and c.seeds < FEWEST_TO_DECIDE:
        needed = max(c.seeds_needed or 0, FEWEST_TO_DECIDE)
        return f"{c.seeds} seeds describe {one} and {other} and do not decide: {ratio}. About {needed} seeds would."
    numbers = f"{ratio}, {p}{family}"
    if c.told_apart:
        word = "more repeatable" if c.metric == "precision" else "more accurate"
        return f"{one} is {word} than {other} here: {numbers}."
    return f"The data do not tell {one} from {other}: {numbers}.{_what_is_missing(c)}"


def _of_seeds(c: Comparison) -> str:
    return "one seed" if c.seeds == 1 else f"{c.seeds} seeds"


def _what_is_missing(c: Comparison) -> str:
    if c.over_seeds:
        return f" About {c.seeds_needed} seeds would settle it." if c.seeds_needed else ""
    if c.p_permutation_floor is not None and c.p_permutation_floor >= ALPHA:
        return f" {min(c.rounds)} rounds are too few: dealt out by chance, they cannot give p below {ALPHA:g}."
    return f" About {c.rounds_needed} rounds each would settle it." if c.rounds_needed else ""
