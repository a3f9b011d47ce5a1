"""Several seeds of one method: intervals for means over seeds, rounds and waypoints.

A seed is a robot with its own gyro bias and its own luck, so what differs between seeds must be in the interval of
whatever stands for a method (design D17). Rounds nest in seeds: what rounds scatter is in the scatter of seeds already,
and needs no term of its own. Waypoints are the same for all seeds: the two factors cross. A seed counts once, in
however many scenarios it was driven, because its robot is the same in all of them.

The table holds one value for each seed and waypoint, NaN where that seed did not complete the waypoint. With n known
values y_sw, mean Y and residuals u_sw = (y_sw - Y) / n, the variance of Y has the parts

    seeds      S / (S - 1) sum_s (sum_w u_sw)^2
    waypoints  N / (N - 1) sum_w (sum_s u_sw)^2 - MS_interaction / n

(crossed random effects; in a table with gaps the linearised form of two-way clusters: Cameron, Gelbach, Miller, J.
Business and Economic Statistics 29, 2011). MS_interaction is the residual mean square of the additive fit, which the
first part contains too. Few seeds know their own scatter badly, and Satterthwaite's degrees of freedom, which are
estimated themselves, make the interval too narrow where seeds differ (88 to 92 % instead of 95 with three seeds). So
the two parts keep their own Student's t, weighted by their size (Cochran, Biometrics 20, 1964):

    half width  (t(S - 1) V_seeds + t(N - 1) V_waypoints) / sqrt(V_seeds + V_waypoints),

over the mean, as a logarithm. `benchmarks/seed_coverage.py` measures how often it holds the truth.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from taskslam.evaluation import intervals
from taskslam.evaluation.metrics_file import Interval, RunMetrics, WaypointMetrics
from taskslam.geometry import FloatArray

Place: TypeAlias = tuple[str, int]
"""A waypoint: scenario and goal index."""

FEWEST_TO_DECIDE = 6
"""Seeds for a verdict: fewer cannot be told from chance, since 2^(1 - 5) > 0.05 of their swaps look alike."""


@dataclass(frozen=True)
class Spread:
    """Variance of the mean of a table, of shape (...). freedom: of seeds and of waypoints."""

    mean: FloatArray
    seeds: FloatArray
    waypoints: FloatArray
    freedom: tuple[int, int]

    def half_width(self, level: float = intervals.LEVEL) -> FloatArray:
        """Half the interval's width as a logarithm, for other seeds at other such waypoints."""
        t_seeds, t_waypoints = (intervals.quantile(level, max(own, 1)) for own in self.freedom)
        total = self.seeds + self.waypoints
        quantile = (t_seeds * self.seeds + t_waypoints * self.waypoints) / np.where(total > 0, total, 1.0)
        return intervals.log_width(self.mean, quantile * np.sqrt(total))

    def half_width_here(self, level: float = intervals.LEVEL) -> FloatArray:
        """The same for other seeds at these very waypoints."""
        return intervals.log_width(self.mean, intervals.quantile(level, self.freedom[0]) * np.sqrt(self.seeds))


def several_seeds(driven: Iterable[tuple[str, int]]) -> bool:
    """Whether any scenario was driven with more than one seed. driven: scenario and seed of each run."""
    seeds: dict[str, set[int]] = {}
    for scenario, seed in driven:
        seeds.setdefault(scenario, set()).add(seed)
    return any(len(own) > 1 for own in seeds.values())


def seed_table(cells: Iterable[tuple[int, Place, Sequence[float]]]) -> FloatArray:
    """(K, S, N) values of K kinds by seed and waypoint; NaN where there is none.

    cells: seed, waypoint, and its K values. Two runs with the same seed are one: their mean. Seeds and waypoints
    without any value have no row and no column.
    """
    known: dict[tuple[int, Place], list[Sequence[float]]] = {}
    for seed, place, values in cells:
        known.setdefault((seed, place), []).append(values)
    seeds = {seed: row for row, seed in enumerate(sorted({seed for seed, _ in known}))}
    places = {place: column for column, place in enumerate(sorted({place for _, place in known}))}
    kinds = len(next(iter(known.values()))[0]) if known else 0
    table = np.full((kinds, len(seeds), len(places)), np.nan)
    for (seed, place), several in known.items():
        table[:, seeds[seed], places[place]] = np.mean(several, axis=0)
    return table


def spread(table: FloatArray) -> Spread:
    """How sure the mean of each (S, N) table of (..., S, N) is; a cell is NaN in all of them or in none.

    Raises ValueError below two seeds, or if a seed or a waypoint has no value.
    """
    known = ~np.isnan(table.reshape(-1, *table.shape[-2:])[0])
    S, N = known.shape
    if S < 2 or not known.any(axis=0).all() or not known.any(axis=1).all():
        raise ValueError("expected values of at least two seeds, each with one, at waypoints that each have one")
    n = int(known.sum())
    mean = np.where(known, table, 0.0).sum(axis=(-2, -1)) / n
    u = np.where(known, table - mean[..., None, None], 0.0) / n
    seeds = S / (S - 1) * (u.sum(axis=-1) ** 2).sum(axis=-1)
    if N == 1:
        return Spread(mean, seeds, np.zeros_like(seeds), (S - 1, 0))
    between = N / (N - 1) * (u.sum(axis=-2) ** 2).sum(axis=-1)
    waypoints = np.maximum(between - n * _residual_mean_square(u, known), 0.0)
    return Spread(mean, seeds, waypoints, (S - 1, N - 1))


def _residual_mean_square(u: FloatArray, known: FloatArray) -> FloatArray:
    """Of the least-squares fit of a seed's plus a waypoint's part to the known cells; 0 where none is left over."""
    S, N = known.shape
    row, column = np.nonzero(known)
    design = np.zeros((len(row), S + N))
    design[np.arange(len(row)), row] = design[np.arange(len(row)), S + column] = 1.0
    values = u[..., row, column].reshape(-1, len(row)).T
    fit, _, rank, _ = np.linalg.lstsq(design, values, rcond=None)
    left = len(row) - int(rank)
    squares = ((values - design @ fit) ** 2).sum(axis=0).reshape(u.shape[:-2])
    return np.asarray(squares / left) if left > 0 else np.zeros_like(squares)


def mean_interval(
    runs: Sequence[RunMetrics],
    of_waypoint: Callable[[WaypointMetrics], float | None],
    level: float = intervals.LEVEL,
) -> Interval | None:
    """Interval, over seeds and waypoints, of the mean of a waypoint's value over the complete waypoints of these runs.

    None if fewer than two seeds have one, or if the value is not known at every complete waypoint.
    """
    found = [
        (run.seed, (run.scenario, waypoint.goal), of_waypoint(waypoint))
        for run in runs
        for waypoint in run.waypoints
        if waypoint.complete
    ]
    cells = [(seed, place, (value,)) for seed, place, value in found if value is not None]
    table = seed_table(cells)
    if len(cells) < len(found) or table.shape[1] < 2:
        return None
    sure = spread(table)
    mean, half = float(sure.mean[0]), float(sure.half_width(level)[0])
    return Interval(low=mean * math.exp(-half), high=mean * math.exp(half))


def design_effect(counts: Sequence[float], of: Sequence[float]) -> float:
    """Variance of a share between seeds over that of independent trials, at least 1 (Kish: Survey Sampling, 1965).

    counts: events of each seed; of: trials of each seed.
    """
    hits, trials = np.asarray(counts, dtype=np.float64), np.asarray(of, dtype=np.float64)
    share, n = float(hits.sum() / trials.sum()), float(trials.sum())
    if not 0 < share < 1 or len(hits) < 2:
        return 1.0
    between = float(((hits - share * trials) ** 2).sum()) * len(hits) / (len(hits) - 1) / n**2
    return max(1.0, between / (share * (1 - share) / n))
