"""Confidence intervals for means over rounds and waypoints, by a two-way jackknife.

Arrivals of one round share the drive, and arrivals at one waypoint share the place. So M rounds at N waypoints are no
sample of M N independent arrivals: they are a table with two random factors. The variance of its mean is that of the
crossed random-effects model (Searle, Casella, McCulloch: Variance Components, 1992, ch. 4),

    V = (MS_rounds + MS_waypoints - MS_interaction) / (M N),

with Satterthwaite's degrees of freedom and Student's t on the logarithm of the mean, since a mean distance is positive
and its noise is proportional to it. E is no mean over rounds: a distance to a mean that the same rounds define. So the
table holds jackknife pseudo-values, M E_i - (M - 1) E_i without round j, where the second is brought to M rounds by the
factor of `precision_bias`.

A visit that the measurement lost is a row of NaN: missing data (`missing.py`). A waypoint of which m of the M rounds
were measured has its E from these, brought to M rounds by the same factor, and m pseudo-values in its column.

Why no bootstrap: a resample of 5 rounds from 5 repeats rounds, which shrinks the scatter that it is to measure. Its
percentile interval holds 80 to 87 % where 95 % are meant; the one here 94 to 96 % (`benchmarks/interval_coverage.py`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import stdtrit

from taskslam.evaluation.missing import circular_mean, column_mean, known_rounds
from taskslam.geometry import FloatArray, wrap

LEVEL = 0.95
_ENDLESS = 1e9  # degrees of freedom from which Student's t is the normal distribution
_WIDEST = 30.0  # e^30: beyond any length, and its exponential is still a number


def precision_bias(rounds: int) -> float:
    """sqrt(1 - 1/M): by how much E of M rounds falls short of E of endlessly many (protocol 7.3 #9).

    The mean of M visits follows them. Exact for isotropic Gaussian scatter. Raises ValueError below two rounds.
    """
    if rounds < 2:
        raise ValueError(f"precision of {rounds} round is not defined; expected at least 2")
    return math.sqrt(1 - 1 / rounds)


@dataclass(frozen=True, slots=True)
class Variance:
    """The variance of means, of shape (...), and how well it is known.

    total: over rounds and waypoints; rounds: its part due to the rounds alone, which is what stays for these very
    waypoints; *_freedom: degrees of freedom of either.
    """

    total: FloatArray
    total_freedom: FloatArray
    rounds: FloatArray
    rounds_freedom: FloatArray


def two_way_variance(tables: Sequence[FloatArray]) -> Variance:
    """Variance of the mean over all waypoints of several runs; a table (..., M_s, N_s) holds a run's pseudo-values.

    Rounds are independent between runs, so their parts add up, each with the square of the run's share of waypoints.
    With one waypoint in all, the waypoints' part is not known and left out. Raises ValueError for a table of fewer
    than two rounds or without a waypoint. No table holds NaN: `missing.filled` sees to that.
    """
    if not tables or any(table.ndim < 2 or table.shape[-2] < 2 or not table.shape[-1] for table in tables):
        raise ValueError("expected tables of at least two rounds and one waypoint")
    waypoints = sum(table.shape[-1] for table in tables)
    rounds, rounds_squared, interaction = np.zeros((3, *tables[0].shape[:-2]))
    for table in tables:
        M, N = table.shape[-2:]
        share = (N / waypoints) ** 2
        of_rounds, of_waypoints = table.sum(axis=-1) / N, table.sum(axis=-2) / M
        away = of_rounds - of_rounds.sum(axis=-1, keepdims=True) / M
        part = share * (away**2).sum(axis=-1) / ((M - 1) * M)
        rounds = rounds + part
        rounds_squared = rounds_squared + part**2 / (M - 1)
        if N > 1:
            rest = table - away[..., None] - of_waypoints[..., None, :]
            interaction = interaction + share * (rest**2).sum(axis=(-2, -1)) / ((M - 1) * (N - 1) * M * N)
    rounds_freedom = _freedom(rounds, rounds_squared)
    if waypoints == 1:
        return Variance(rounds, rounds_freedom, rounds, rounds_freedom)
    columns = np.concatenate([table.sum(axis=-2) / table.shape[-2] for table in tables], axis=-1)
    columns = columns - columns.sum(axis=-1, keepdims=True) / waypoints
    between = (columns**2).sum(axis=-1) / ((waypoints - 1) * waypoints)
    total = np.maximum(rounds + between - interaction, np.maximum(rounds, between))
    freedom = _freedom(total, rounds_squared + between**2 / (waypoints - 1))
    return Variance(total, freedom, rounds, rounds_freedom)


def _freedom(variance: FloatArray, squared: FloatArray) -> FloatArray:
    """Satterthwaite's degrees of freedom; endless for a variance of 0."""
    return np.where(squared > 0, variance**2 / np.where(squared > 0, squared, 1.0), math.inf)


def precision_table(positions: FloatArray) -> FloatArray:
    """(M, N) pseudo-values of E from (M, N, 2) or (M, N, 3) positions of complete waypoints, in metres; M of 3 or more.

    Column i has the mean of E_i up to the jackknife's own small correction.
    """
    return pseudo_values(mean_distance(positions), without_each_round(positions))


def heading_table(headings: FloatArray) -> FloatArray:
    """As `precision_table`, of Delta from (M, N) headings in radians.

    Deviations of a few degrees from the circular mean add like lengths, so they are treated as such.
    """
    line = headings_on_a_line(headings)
    return pseudo_values(mean_distance(line), without_each_round(line))


def headings_on_a_line(headings: FloatArray) -> FloatArray:
    """(M, N, 1) angles from the circular mean of each column of (M, N) headings, rad."""
    return np.asarray(wrap(headings - circular_mean(headings))[..., None])


def mean_distance(positions: FloatArray) -> FloatArray:
    """(..., N) mean distance to the mean, E, of (..., M, N, D) positions; NaN below two visits.

    Of fewer than M visits it is brought to M: times `precision_bias(M)` over that of as many as there are.
    """
    rounds = positions.shape[-3]
    if np.isnan(positions).any():
        return _mean_distance_of_known(positions)
    offsets = positions - positions.sum(axis=-3, keepdims=True) / rounds
    return np.asarray(np.sqrt((offsets**2).sum(axis=-1)).sum(axis=-2) / rounds)


def _mean_distance_of_known(positions: FloatArray) -> FloatArray:
    visits = known_rounds(positions[..., 0], axis=-2)
    offsets = positions - column_mean(positions, axis=-3)
    with np.errstate(divide="ignore", invalid="ignore"):  # without a visit 0 / 0, with one no scatter
        E = np.nansum(np.sqrt((offsets**2).sum(axis=-1)), axis=-2) / visits
        brought = np.sqrt((1 - 1 / positions.shape[-3]) / (1 - 1 / visits))
        return np.asarray(np.where(visits > 1, E * np.where(visits < positions.shape[-3], brought, 1.0), np.nan))


def without_each_round(positions: FloatArray) -> FloatArray:
    """(M, N) E without round j, brought to M rounds, of (M, N, D) positions; NaN where round j has no visit."""
    M = len(positions)
    if M < 3:
        raise ValueError(f"{M} rounds leave no scatter when one is taken out; expected at least 3")
    if np.isnan(positions).any():
        fewer = np.repeat(positions[None], M, axis=0)
        fewer[np.arange(M), np.arange(M)] = np.nan
        return np.where(np.isnan(positions[..., 0]), np.nan, _mean_distance_of_known(fewer))
    means = (positions.sum(axis=0) - positions) / (M - 1)
    distances = np.sqrt(((positions[None] - means[:, None]) ** 2).sum(axis=-1))
    distances[np.arange(M), np.arange(M)] = 0.0
    return np.asarray(distances.sum(axis=1) / (M - 1) * precision_bias(M) / precision_bias(M - 1))


def log_half_width(
    mean: npt.ArrayLike, variance: npt.ArrayLike, freedom: npt.ArrayLike, level: float = LEVEL
) -> FloatArray:
    """Half the width of the interval of a positive mean, as a logarithm: t sqrt(V) / mean, or 0 for a mean of 0."""
    return log_width(mean, quantile(level, freedom) * np.sqrt(variance))


def log_width(mean: npt.ArrayLike, half: npt.ArrayLike) -> FloatArray:
    """Half an interval's width in the unit of a positive mean, as a logarithm; 0 for a mean of 0."""
    mean = np.asarray(mean, dtype=np.float64)
    return np.where(mean > 0, np.minimum(half / np.where(mean > 0, mean, 1.0), _WIDEST), 0.0)


def quantile(level: float, freedom: npt.ArrayLike) -> FloatArray:
    """Student's t for a two-sided interval of that level."""
    return np.asarray(stdtrit(np.minimum(freedom, _ENDLESS), 0.5 + level / 2))


def rounds_to_halve(rounds: int, level: float = LEVEL) -> int:
    """How many rounds make the interval for these same waypoints half as wide: t(M' - 1) / sqrt(M') against M.

    For the expected width, on a logarithmic scale. Raises ValueError below three rounds.
    """
    if rounds < 3:
        raise ValueError(f"{rounds} rounds give no interval; expected at least 3")
    goal = quantile(level, rounds - 1) / math.sqrt(rounds) / 2
    more = rounds + 1
    while quantile(level, more - 1) / math.sqrt(more) > goal:
        more += 1
    return more


def pseudo_values(whole: FloatArray, without: FloatArray) -> FloatArray:
    """(M, N) jackknife pseudo-values of (N,) values, from the (M, N) values without each round; NaN stays NaN.

    M is the number of values in the column: of a waypoint with m visits, m x_i - (m - 1) x_i without round j.
    """
    M = known_rounds(without, axis=0)
    return np.asarray(M * whole - (M - 1) * without)


def ratio_of(difference: float) -> float:
    """The ratio whose logarithm is given, kept within e^-100 to e^100: what is beyond says no more, and overflows."""
    return math.exp(min(max(difference, -100.0), 100.0))
