"""How sure the means of a run, or of several runs of one method together, are (docs/metrics.md)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taskslam.evaluation import intervals
from taskslam.evaluation.completeness import expected_completeness, failure_chance
from taskslam.evaluation.curves import EXACT_RANGE
from taskslam.evaluation.metrics_file import Interval, Legs, RunMetrics, Uncertainty
from taskslam.evaluation.missing import column_mean, filled
from taskslam.evaluation.seeds import Place, design_effect, seed_table, several_seeds
from taskslam.evaluation.seeds import spread as spread_over_seeds
from taskslam.geometry import FloatArray, wrap
from taskslam.mode import Mode

_LOST = (math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class Sample:
    """What one run contributes. visits: (M, N, 3) true poses at its complete waypoints, goals: (N, 3).

    visits is NaN where the measurement lost one, None if one is not known for another reason; goals is None if true
    poses have no place in their frame. driven, failed: legs, those of the priming round included. scenario, seed and
    the indices of the complete waypoints say which runs are seeds of one another.
    """

    visits: FloatArray | None
    goals: FloatArray | None
    complete: int
    planned: int
    rounds: int
    with_map: bool
    on_failure: str
    driven: int
    failed: int
    scenario: str = ""
    seed: int = 0
    indices: tuple[int, ...] = ()

    @property
    def places(self) -> list[Place]:
        """Its complete waypoints."""
        return [(self.scenario, index) for index in self.indices]


def sample_of(run: RunMetrics) -> Sample:
    """The sample behind the metrics of a run."""
    legs = run.uncertainty.legs
    return Sample(
        visits=complete_visits(run),
        goals=None
        if run.truth_frame == "waypoint"
        else np.array([w.target for w in run.waypoints if w.complete]).reshape(-1, 3),
        complete=run.complete_waypoints,
        planned=run.planned_waypoints,
        rounds=run.rounds,
        with_map=run.mode == Mode.WITH_MAP,
        on_failure=legs.on_failure,
        driven=legs.driven,
        failed=legs.failed,
        scenario=run.scenario,
        seed=run.seed,
        indices=tuple(waypoint.goal for waypoint in run.waypoints if waypoint.complete),
    )


def complete_visits(run: RunMetrics, goals: Sequence[int] | None = None) -> FloatArray | None:
    """(M, N, 3) true poses of a run at its complete waypoints, or at those of the given goal indices.

    NaN where the measurement lost one; None if one is not known for another reason. Rounds in their order.
    """
    wanted = [run.waypoints[goal] for goal in goals] if goals is not None else [w for w in run.waypoints if w.complete]
    rows = [[visit.truth for visit in waypoint.arrivals] for waypoint in wanted]
    for waypoint, row in zip(wanted, rows, strict=True):
        if len(row) != run.rounds or sum(truth is not None for truth in row) != waypoint.rounds:
            return None
    poses = [[truth or _LOST for truth in row] for row in rows]
    return np.array(poses, dtype=np.float64).reshape(len(rows), run.rounds, 3).transpose(1, 0, 2)


def uncertainty(samples: Sequence[Sample], missing: int = 0, level: float = intervals.LEVEL) -> Uncertainty:
    """Intervals for the means over all complete waypoints of these runs together, and for their completeness.

    Over seeds and waypoints where a scenario was driven with several seeds (`seeds.py`), else over rounds and
    waypoints. missing: planned waypoints of sequences without a run, which count as never reached. Raises ValueError
    for no run.
    """
    if not samples:
        raise ValueError("no run: expected at least one")
    known = [sample for sample in samples if sample.complete]
    visits = [sample.visits for sample in known if sample.visits is not None]
    if len(visits) < len(known):
        visits = []
    fewest = min(sample.rounds for sample in samples)
    several = several_seeds((sample.scenario, sample.seed) for sample in samples)
    seeds = len({sample.seed for sample in known}) if several else 1
    legs = _legs(samples, level)
    complete = _completeness(samples, missing, legs, level)
    means, E = _means(known, visits, several, level) if visits else ({}, [])
    return Uncertainty(
        level=level,
        precision_m=_interval(means, "total"),
        precision_here_m=_interval(means, "here"),
        accuracy_m=_interval(means, "position"),
        precision_rad=_interval(means, "turn", most=math.pi),
        accuracy_rad=_interval(means, "heading", most=math.pi),
        completeness=complete,
        n_auc_exact=_n_auc(samples, missing, E, means.get("total"), complete) if fewest > 1 else None,
        precision_unbiased_m=_unbiased(visits) if visits and fewest >= 2 else None,
        legs=legs,
        rounds_to_halve=intervals.rounds_to_halve(fewest, level) if fewest >= 3 and not several else None,
        seeds=seeds,
        seeds_to_halve=intervals.rounds_to_halve(seeds, level) if seeds >= 3 else None,
    )


Ends = tuple[float, float]
"""A mean and half its interval's width, as a logarithm."""


def _means(
    known: Sequence[Sample], visits: Sequence[FloatArray], several: bool, level: float
) -> tuple[dict[str, Ends], list[FloatArray]]:
    """Means as far as rounds, and seeds if there are several, allow; and E of every waypoint.

    E (`total`, and at these very waypoints `here`), e (`position`), Delta (`turn`) and delta (`heading`).
    """
    fewest = min(len(v) for v in visits)
    goals = [sample.goals for sample in known if sample.goals is not None]
    placed = len(goals) == len(visits)
    if several and len({sample.seed for sample in known}) < 2:
        return {}, []
    if several:
        spread, E = _spread_of_seeds(known, visits, level) if fewest >= 2 else ({}, [])
        return spread | (_distance_of_seeds(known, visits, goals, level) if placed else {}), E
    spread, E = _spread(visits, level) if fewest >= 3 else ({}, [])
    return spread | (_distance(visits, goals, level) if placed and fewest >= 2 else {}), E


def _spread_of_seeds(
    known: Sequence[Sample], visits: Sequence[FloatArray], level: float
) -> tuple[dict[str, Ends], list[FloatArray]]:
    """As `_spread`, over seeds."""
    E = [intervals.mean_distance(v[..., :2]) for v in visits]
    turns = [intervals.mean_distance(intervals.headings_on_a_line(v[..., 2])) for v in visits]
    sure = spread_over_seeds(_table_of_seeds(known, E, turns))
    half, here = sure.half_width(level), sure.half_width_here(level)
    mean = sure.mean
    return {"total": (mean[0], half[0]), "here": (mean[0], here[0]), "turn": (mean[1], half[1])}, E


def _distance_of_seeds(
    known: Sequence[Sample], visits: Sequence[FloatArray], goals: Sequence[FloatArray], level: float
) -> dict[str, Ends]:
    """As `_distance`, over seeds."""
    tables = [_distances(v, g) for v, g in zip(visits, goals, strict=True)]
    columns = [column_mean(table, axis=-2)[..., 0, :] for table in tables]
    sure = spread_over_seeds(_table_of_seeds(known, [c[0] for c in columns], [c[1] for c in columns]))
    half = sure.half_width(level)
    return {"position": (sure.mean[0], half[0]), "heading": (sure.mean[1], half[1])}


def _table_of_seeds(known: Sequence[Sample], *kinds: Sequence[FloatArray]) -> FloatArray:
    """(K, S, N) values of each kind, of which each run has one at every complete waypoint."""
    return seed_table(
        (sample.seed, place, values)
        for sample, *columns in zip(known, *kinds, strict=True)
        for place, *values in zip(sample.places, *columns, strict=True)
    )


def _spread(visits: Sequence[FloatArray], level: float) -> tuple[dict[str, Ends], list[FloatArray]]:
    """E over rounds and waypoints (`total`) and over rounds (`here`), and Delta (`turn`); E of every waypoint."""
    E = [intervals.mean_distance(v[..., :2]) for v in visits]
    tables = _filled(
        [np.stack([intervals.precision_table(v[..., :2]), intervals.heading_table(v[..., 2])]) for v in visits]
    )
    if not tables:
        return {}, E
    variance = intervals.two_way_variance(tables)
    means = np.array([_mean_of(E), _mean_of([table[1] for table in tables])])
    total = intervals.log_half_width(means, variance.total, variance.total_freedom, level)
    here = intervals.log_half_width(means, variance.rounds, variance.rounds_freedom, level)
    ends = {"total": (means[0], total[0]), "here": (means[0], here[0]), "turn": (means[1], total[1])}
    return ends, E


def _distance(visits: Sequence[FloatArray], goals: Sequence[FloatArray], level: float) -> dict[str, Ends]:
    """Accuracy in `position`, e, and in `heading`, delta."""
    tables = _filled([_distances(v, g) for v, g in zip(visits, goals, strict=True)])
    variance = intervals.two_way_variance(tables)
    means = np.array([_mean_of([table[kind] for table in tables]) for kind in (0, 1)])
    half = intervals.log_half_width(means, variance.total, variance.total_freedom, level)
    return {"position": (means[0], half[0]), "heading": (means[1], half[1])}


def _distances(visits: FloatArray, goals: FloatArray) -> FloatArray:
    """(2, M, N) distances and angles of arrivals to their goals."""
    offsets = visits - goals
    return np.stack([np.hypot(offsets[..., 0], offsets[..., 1]), np.abs(wrap(offsets[..., 2]))])


def _filled(tables: Sequence[FloatArray]) -> list[FloatArray]:
    whole = [filled(table) for table in tables]
    return [table for table in whole if table is not None]


def _interval(ends: dict[str, Ends], name: str, most: float = math.inf) -> Interval | None:
    if name not in ends:
        return None
    mean, half = (float(number) for number in ends[name])
    return Interval(low=mean * intervals.ratio_of(-half), high=min(mean * intervals.ratio_of(half), most))


def _mean_of(tables: Sequence[FloatArray]) -> float:
    """Mean over all waypoints, each with weight 1, whatever the rounds of its run; of (M, N) tables or (N,) values."""
    total = math.fsum(float(table.sum()) / (len(table) if table.ndim == 2 else 1) for table in tables)
    return total / sum(int(table.shape[-1]) for table in tables)


def _unbiased(visits: Sequence[FloatArray]) -> float:
    return _mean_of([intervals.mean_distance(v[..., :2]) / intervals.precision_bias(len(v)) for v in visits])


def _legs(samples: Sequence[Sample], level: float) -> Legs:
    driven, failed = sum(s.driven for s in samples), sum(s.failed for s in samples)
    effect = _legs_effect(samples)
    low, high = failure_chance(failed / effect, driven / effect, level)
    rules = sorted({sample.on_failure for sample in samples})
    return Legs(driven=driven, failed=failed, on_failure="/".join(rules), failure_chance=Interval(low=low, high=high))


def _legs_effect(samples: Sequence[Sample]) -> float:
    """By what legs of several seeds count less than independent ones, since some seeds fail more than others."""
    own: dict[int, list[Sample]] = {}
    for sample in samples:
        own.setdefault(sample.seed, []).append(sample)
    if not several_seeds((sample.scenario, sample.seed) for sample in samples):
        return 1.0
    return design_effect(
        [sum(s.failed for s in seed) for seed in own.values()], [sum(s.driven for s in seed) for seed in own.values()]
    )


def _completeness(samples: Sequence[Sample], missing: int, legs: Legs, level: float) -> Interval:
    """What the protocol makes of the failure chance per leg; widened where needed to hold what was observed.

    Where seeds differ, that is no chance which all legs share: then widened by Student's interval over the seeds too.
    """
    planned = sum(sample.planned for sample in samples) + missing
    observed = sum(sample.complete for sample in samples) / planned
    low, high = (
        math.fsum(
            sample.planned
            * expected_completeness(
                chance, sample.planned, sample.rounds, on_failure=sample.on_failure, with_map=sample.with_map
            )
            for sample in samples
        )
        / planned
        for chance in (legs.failure_chance.high, legs.failure_chance.low)
    )
    seeds = _completeness_of_seeds(samples)
    if len(seeds) > 1:
        half = float(intervals.quantile(level, len(seeds) - 1) * np.std(seeds, ddof=1)) / math.sqrt(len(seeds))
        low, high = min(low, observed - half), max(high, observed + half)
    return Interval(low=max(min(low, observed), 0.0), high=min(max(high, observed), 1.0))


def _completeness_of_seeds(samples: Sequence[Sample]) -> list[float]:
    """The completeness of each seed; of one seed alone, nothing."""
    if not several_seeds((sample.scenario, sample.seed) for sample in samples):
        return []
    own: dict[int, list[Sample]] = {}
    for sample in samples:
        own.setdefault(sample.seed, []).append(sample)
    return [sum(s.complete for s in seed) / sum(s.planned for s in seed) for seed in own.values()]


def _n_auc(
    samples: Sequence[Sample], missing: int, E: Sequence[FloatArray], spread: Ends | None, complete: Interval
) -> Interval | None:
    """The exact N-AUC is completeness times the mean of 1 - min(E, 120 cm) / 120 cm over complete waypoints.

    Both vary, and apart: the distances to the ends of their intervals, as logarithms, add in quadrature (Zou, Donner:
    Statistics in Medicine 27, 2008). The second has the relative interval of E.
    """
    observed = sum(sample.complete for sample in samples) / (sum(sample.planned for sample in samples) + missing)
    if observed == 0:
        return Interval(low=0.0, high=complete.high)
    if spread is None:
        return None
    lost, half = _mean_of([np.minimum(1.0, values / EXACT_RANGE) for values in E]), float(spread[1])
    area, low, high = 1 - lost, max(1 - lost * math.exp(half), 0.0), 1 - lost * math.exp(-half)
    down = math.hypot(_log_ratio(observed, complete.low), _log_ratio(area, low))
    up = math.hypot(_log_ratio(complete.high, observed), _log_ratio(high, area))
    return Interval(low=observed * area * math.exp(-down), high=min(1.0, observed * area * math.exp(up)))


def _log_ratio(larger: float, smaller: float) -> float:
    if larger <= 0:
        return 0.0
    return math.log(larger / smaller) if smaller > 0 else math.inf
