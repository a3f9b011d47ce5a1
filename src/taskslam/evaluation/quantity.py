"""`Quantity`: one thing that is measured of runs, with all that anyone needs to show or judge it.

metrics.json, the tables on screen, page and paper, CSV and the gate iterate over the list of quantities
(`quantities/`); none of them knows a quantity by its name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum, StrEnum

from taskslam.evaluation.metrics_file import Interval, RunMetrics, Uncertainty, WaypointMetrics

OfRuns = Callable[[Sequence[RunMetrics], Sequence[int]], float | None]
OfWaypoint = Callable[[WaypointMetrics], float | None]
IntervalOf = Callable[[Sequence[RunMetrics], Uncertainty], Interval | None]


@dataclass(frozen=True)
class _Shown:
    """How people write a dimension. si: the unit of values; unit: theirs, and factor: how many of it one SI unit is."""

    si: str
    unit: str
    factor: float


class Dimension(Enum):
    """What kind of number a quantity is."""

    LENGTH = _Shown("m", "cm", 100.0)
    ANGLE = _Shown("rad", "deg", math.degrees(1.0))
    SHARE = _Shown("", "%", 100.0)
    NUMBER = _Shown("", "", 1.0)


class WorseIs(StrEnum):
    """In which direction a quantity gets worse."""

    MORE = "+"
    LESS = "-"


class Judged(StrEnum):
    """How the gate tells a worse value from chance.

    ARRIVALS: by the arrivals of both methods, waypoint by waypoint (`comparison.py`); EVENT: any change beyond the
    tolerance counts; BOTH: what changes with completeness is an event, what changes with E is held against arrivals;
    INTERVAL: only if the intervals of both lie apart.
    """

    ARRIVALS = "arrivals"
    EVENT = "event"
    BOTH = "both"
    INTERVAL = "interval"


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A quantity.

    key: its name in metrics.json, CSV and rules of the gate; symbol: short, as in formulas; words: what it is, in a
    sentence without a full stop. of_runs: its value over one or more runs of a method in a mode, in SI units, None
    where it is not defined; it is given the runs, and the planned waypoints of sequences that have no run, which must
    never make a method look better. of_waypoint: its value at a waypoint of one run, if it has one there. interval:
    of the value over runs. fair: whether only the most complete methods compete for the best value, since the mean of a
    method that completes easy waypoints alone is small. digits: after the point, of a NUMBER. latex: the symbol.
    essential: shown where there is little room.
    """

    key: str
    symbol: str
    words: str
    dimension: Dimension
    worse_is: WorseIs
    of_runs: OfRuns
    of_waypoint: OfWaypoint | None = None
    interval: IntervalOf | None = None
    judged: Judged = Judged.INTERVAL
    fair: bool = True
    digits: int = 3
    latex: str = ""
    essential: bool = True

    @property
    def best_of(self) -> Callable[[Iterable[float]], float]:
        """Picks the best of some values."""
        return min if self.worse_is is WorseIs.MORE else max

    @property
    def column(self) -> str:
        """Its name in CSV, with the SI unit."""
        si = self.dimension.value.si
        return self.key if not si or self.key.endswith(f"_{si}") else f"{self.key}_{si}"


def mean_over_complete(of_waypoint: OfWaypoint) -> OfRuns:
    """The mean over all complete waypoints of the runs, each with weight 1 (eq. (3) of the paper; protocol 5.3)."""

    def mean(runs: Sequence[RunMetrics], missing: Sequence[int]) -> float | None:  # noqa: ARG001 means know no missing
        values = [of_waypoint(waypoint) for run in runs for waypoint in run.waypoints if waypoint.complete]
        defined = [value for value in values if value is not None]
        return math.fsum(defined) / len(defined) if defined else None

    return mean
