"""The estimation share of E: what SLAM adds to the scatter of arrivals, apart from what the controller scatters.

Navigation stops anywhere within its tolerance, so an arrival is the sum of two errors: where the robot believes it
stands against the goal (control), and where it stands against where it believes it stands (estimation). With
d_j = z_j - z^_j, truth minus estimate at arrival j:

    E_SLAM = mean_j |d_j - mean d|

E of the same waypoint if the controller always stopped at the very same believed place. The two errors are vectors that
know nothing of one another, so their squares add, not their lengths: E^2 = E_control^2 + E_SLAM^2 for isotropic
Gaussian scatter. Where E is mostly the controller's, this is what tells methods apart (protocol 7.3 #9).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from taskslam.evaluation import intervals
from taskslam.evaluation.metrics_file import Interval, RunMetrics, Uncertainty
from taskslam.evaluation.missing import filled
from taskslam.evaluation.quantity import Dimension, Quantity, WorseIs, mean_over_complete
from taskslam.evaluation.seeds import mean_interval, several_seeds
from taskslam.geometry import FloatArray

_of_runs = mean_over_complete(lambda waypoint: waypoint.estimation.spread_m)


def _errors(run: RunMetrics) -> FloatArray | None:
    """(M, N, 2) truth minus estimate at complete waypoints, NaN where the measurement lost a pose; None if unknown."""
    complete = [waypoint for waypoint in run.waypoints if waypoint.complete]
    if any(len(waypoint.arrivals) != run.rounds for waypoint in complete) or run.truth_frame != "map":
        return None
    lost = (math.nan, math.nan)
    rows = [
        [
            np.subtract(visit.truth[:2], visit.estimate[:2]) if visit.truth and visit.estimate else lost
            for visit in waypoint.arrivals
        ]
        for waypoint in complete
    ]
    return np.array(rows, dtype=np.float64).reshape(len(rows), run.rounds, 2).transpose(1, 0, 2)


def _interval(runs: Sequence[RunMetrics], sure: Uncertainty) -> Interval | None:
    """As that of E: over seeds and waypoints, or over rounds and waypoints by the two-way jackknife (decision 007)."""
    if several_seeds((run.scenario, run.seed) for run in runs):
        return mean_interval(runs, lambda waypoint: waypoint.estimation.spread_m, sure.level)
    known = [run for run in runs if run.complete_waypoints]
    errors = [_errors(run) for run in known]
    tables = [
        table
        for found in errors
        if found is not None and len(found) > 2 and (table := filled(intervals.precision_table(found))) is not None
    ]
    mean = _of_runs(runs, ())
    if mean is None or not known or len(tables) < len(known):
        return None
    variance = intervals.two_way_variance(tables)
    half = float(intervals.log_half_width(mean, variance.total, variance.total_freedom, sure.level))
    return Interval(low=mean * math.exp(-half), high=mean * math.exp(half))


ESTIMATION = Quantity(
    key="estimation_precision",
    symbol="E_SLAM",
    words="what SLAM's estimate adds to E: scatter of the error of the estimate on arrival",
    dimension=Dimension.LENGTH,
    worse_is=WorseIs.MORE,
    of_runs=_of_runs,
    of_waypoint=lambda waypoint: waypoint.estimation.spread_m,
    interval=_interval,
    latex=r"$E_\mathrm{SLAM}$",
    essential=False,
)
