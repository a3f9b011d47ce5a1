"""Where the spread comes from: shares of sensor noise, threads and a method's own seed in what its runs differ by.

With V the variance of a result, such as log E, over runs in which everything differs,

    share of a source that was held fixed   1 - V(held) / V     first-order Sobol index, Var(E[y | source]) / V
    share of a source that alone differed   V(alone) / V        the same of a source that adds to the others

(Saltelli et al.: Global Sensitivity Analysis, 2008, ch. 1). Threads cannot be held fixed: they are what is left where
the very same run is driven again. A source may be held at several values; then the variance within each is pooled.
What the shares leave to 1 is interaction. The ratio of two variances of normal values has the interval of the F
distribution, which is wide: ten runs a side tell a share to about a half.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtri

from taskslam.evaluation.intervals import LEVEL
from taskslam.evaluation.metrics_file import Interval, RunMetrics

Groups = Sequence[Sequence[float]]


@dataclass(frozen=True)
class Share:
    """Of one source in the variance; share: 0 to 1. runs: in which it was held, or alone."""

    source: str
    share: float
    interval: Interval
    runs: int


def spread_shares(
    everything: Sequence[float],
    held: Mapping[str, Groups] | None = None,
    alone: Mapping[str, Groups] | None = None,
    level: float = LEVEL,
) -> tuple[Share, ...]:
    """The share of each source, in the order given.

    everything: values of runs in which all sources differ; held: for each source, groups of runs that share its value;
    alone: for each source, groups of runs that share all but this one. NaN, a run without a value, is left out. Raises
    ValueError where two values at least are not there, or if runs in which everything differs are all alike.
    """
    whole, freedom = _within("everything", [everything])
    if whole == 0:
        raise ValueError("runs in which everything differs are all alike; there is no spread to share out")
    found = []
    for groups, rest in ((held or {}, True), (alone or {}, False)):
        for source, values in groups.items():
            variance, own = _within(source, values)
            ratio = variance / whole
            low, high = (ratio / float(fdtri(own, freedom, p)) for p in (0.5 + level / 2, 0.5 - level / 2))
            ends = sorted((_share(low, rest), _share(high, rest)))
            count = sum(not math.isnan(value) for group in values for value in group)
            found.append(Share(source, _share(ratio, rest), Interval(low=ends[0], high=ends[1]), count))
    return tuple(found)


def log_precision(run: RunMetrics) -> float:
    """What is shared out: the mean over complete waypoints of log E; NaN where E is not known at any."""
    known = [w.position.precision_m for w in run.waypoints if w.complete and w.position.precision_m is not None]
    return math.fsum(math.log(max(E, 1e-6)) for E in known) / len(known) if known else math.nan


def _share(ratio: float, rest: bool) -> float:
    return min(max(1 - ratio if rest else ratio, 0.0), 1.0)


def _within(source: str, groups: Groups) -> tuple[float, int]:
    """Pooled variance within groups, and its degrees of freedom."""
    known = [np.array([value for value in group if not math.isnan(value)]) for group in groups]
    freedom = sum(max(len(values) - 1, 0) for values in known)
    if freedom < 1:
        raise ValueError(f"{source}: expected at least two runs with a value that can be compared")
    squares = math.fsum(float(((values - values.mean()) ** 2).sum()) for values in known if len(values))
    return squares / freedom, freedom
