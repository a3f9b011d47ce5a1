"""Success within tolerance: how many planned arrivals a follow-up task of 2 cm and 2 degrees would succeed at.

    S = #{arrivals with |z_j - mean z| <= 2 cm and |wrap(theta_j - mean theta)| <= 2 deg} / #{planned arrivals}

with the means over a waypoint's arrivals (`tolerance.py`, where also the curve over tolerances comes from). An arrival
that was missed is a failure, and so is the only arrival at a waypoint.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import betaincinv

from taskslam.evaluation.intervals import LEVEL, quantile
from taskslam.evaluation.metrics_file import Interval, RunMetrics, Uncertainty, WaypointMetrics
from taskslam.evaluation.quantity import Dimension, Quantity, WorseIs
from taskslam.evaluation.seeds import Place, design_effect, seed_table, several_seeds, spread
from taskslam.evaluation.tolerance import ArrivalSpread, arrival_spread, success
from taskslam.geometry import FloatArray, wrap

POSITION_M, HEADING_RAD = 0.02, math.radians(2.0)


def success_curve(runs: Sequence[RunMetrics], missing: Sequence[int]) -> tuple[tuple[float, ...], int] | None:
    """Steps of the curve over position tolerances, at a heading within 2 degrees; None where success is not defined.

    Distances in metres of arrivals to their mean, in order, of those whose heading is within; and planned arrivals.
    """
    spread = _spread(runs, missing)
    if not spread.planned or not _is_known(runs):
        return None
    return tuple(np.sort(spread.distances[spread.angles <= HEADING_RAD]).tolist()), spread.planned


def _of_runs(runs: Sequence[RunMetrics], missing: Sequence[int]) -> float | None:
    spread = _spread(runs, missing)
    return float(success(spread, [POSITION_M], HEADING_RAD)[0]) if spread.planned and _is_known(runs) else None


def _spread(runs: Sequence[RunMetrics], missing: Sequence[int]) -> ArrivalSpread:
    return arrival_spread(runs, sum(missing) * max(run.rounds for run in runs))


def _is_known(runs: Sequence[RunMetrics]) -> bool:
    """Whether true poses of arrivals are known at all, and rounds can agree: a round alone agrees with nothing."""
    visits = [visit for run in runs for waypoint in run.waypoints for visit in waypoint.arrivals]
    return all(run.rounds > 1 for run in runs) and (not visits or any(visit.truth is not None for visit in visits))


def _within(waypoint: WaypointMetrics) -> list[float]:
    """1 or 0 for each arrival that can be told."""
    truths = np.array([visit.truth for visit in waypoint.arrivals if visit.truth is not None])
    if len(truths) == 1:
        return [0.0]
    if not len(truths) or waypoint.mean_pose is None:
        return []
    away = truths - waypoint.mean_pose
    near = (np.hypot(away[:, 0], away[:, 1]) <= POSITION_M) & (np.abs(wrap(away[:, 2])) <= HEADING_RAD)
    return [float(one) for one in near]


def _of_waypoint(waypoint: WaypointMetrics) -> float | None:
    if waypoint.unjudged is not None or waypoint.rounds < 2:
        return None
    within = _within(waypoint)
    if waypoint.arrivals and not within:
        return None
    return sum(within) / waypoint.rounds


def _interval(runs: Sequence[RunMetrics], sure: Uncertainty) -> Interval | None:  # noqa: ARG001 an interval of its own
    """Jeffreys' interval, with as many independent arrivals as the scatter between waypoints, and seeds, leaves.

    Arrivals at one waypoint are alike: with shares s_i of n_i arrivals, the variance of their mean over that of
    independent arrivals is the design effect (Kish 1965), at least 1, by which the number of arrivals is divided.
    """
    judged = [(run.seed, (run.scenario, w.goal), w) for run in runs for w in run.waypoints if w.unjudged is None]
    hits = np.array([sum(_within(waypoint)) for *_, waypoint in judged])
    counts = np.array([waypoint.rounds for *_, waypoint in judged], dtype=np.float64)
    share, n = float(hits.sum() / counts.sum()), float(counts.sum())
    if 0 < share < 1:
        if several_seeds((run.scenario, run.seed) for run in runs):
            n = _independent_over_seeds([(seed, place) for seed, place, _ in judged], hits, counts)
        else:
            n /= design_effect(hits.tolist(), counts.tolist())
    tail, hit = (1 - LEVEL) / 2, share * n
    low = float(betaincinv(hit + 0.5, n - hit + 0.5, tail)) if share > 0 else 0.0
    high = float(betaincinv(hit + 0.5, n - hit + 0.5, 1 - tail)) if share < 1 else 1.0
    return Interval(low=min(low, share), high=max(high, share))


def _independent_over_seeds(cells: Sequence[tuple[int, Place]], hits: FloatArray, counts: FloatArray) -> float:
    """Independent arrivals that would know their share as well as those of several seeds do.

    The half width over seeds and waypoints, h, says so: n = (z / h)^2 s (1 - s), with z of the normal distribution.
    """
    share = float(hits.sum() / counts.sum())
    shares = [(seed, place, (hit / of,)) for (seed, place), hit, of in zip(cells, hits, counts, strict=True)]
    sure = spread(seed_table(shares))
    half = float(sure.half_width()[0] * sure.mean[0])
    most = float(counts.sum())
    normal = float(quantile(LEVEL, math.inf))
    return min(most, (normal / half) ** 2 * share * (1 - share)) if half > 0 else most


SUCCESS = Quantity(
    key="success_2cm_2deg",
    symbol="S",
    words="planned arrivals within 2 cm and 2° of their waypoint's mean pose",
    dimension=Dimension.SHARE,
    worse_is=WorseIs.LESS,
    of_runs=_of_runs,
    of_waypoint=_of_waypoint,
    interval=_interval,
    fair=False,
    latex="$S$",
    essential=False,
)
