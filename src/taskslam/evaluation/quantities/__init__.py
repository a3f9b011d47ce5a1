"""The list of quantities: ours, in the order in which they are shown, then those that other packages register.

A package adds one by an entry point of the group `taskslam.quantities` that leads to a `Quantity`; it is then in
metrics.json, in every table and in the rules of the gate.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import lru_cache

from taskslam.errors import InputError, did_you_mean
from taskslam.evaluation.metrics_file import Measured, RunMetrics, Uncertainty, WaypointMetrics
from taskslam.evaluation.quantities import area, estimation, published, success
from taskslam.evaluation.quantity import Quantity
from taskslam.plugins import registered

GROUP = "taskslam.quantities"

_OURS = (
    published.COMPLETENESS,
    published.PRECISION,
    estimation.ESTIMATION,
    published.ACCURACY,
    published.HEADING_PRECISION,
    published.HEADING_ACCURACY,
    area.EXACT,
    area.PUBLISHED,
    success.SUCCESS,
)


def quantities() -> tuple[Quantity, ...]:
    """Every quantity, in the order in which they are shown. Raises InputError if one that is registered is broken."""
    return _OURS + _others(tuple(sys.path))


def quantity(key: str) -> Quantity:
    """The quantity of a key. Raises InputError with a guess."""
    known = {one.key: one for one in quantities()}
    if key not in known:
        raise InputError(f"unknown quantity '{key}'; expected one of {', '.join(known)}.{did_you_mean(key, known)}")
    return known[key]


def measured(runs: Sequence[RunMetrics], missing: Sequence[int], sure: Uncertainty) -> dict[str, Measured]:
    """Every quantity over these runs of one method in one mode. missing: as in `Quantity`; sure: of their means."""
    found = {}
    for one in quantities():
        value = one.of_runs(runs, missing)
        interval = one.interval(runs, sure) if one.interval is not None and value is not None else None
        found[one.key] = Measured(
            value=value, low=interval.low if interval else None, high=interval.high if interval else None
        )
    return found


def measured_at(waypoint: WaypointMetrics) -> dict[str, float]:
    """Every quantity that has a value at a waypoint."""
    values = {one.key: one.of_waypoint(waypoint) for one in quantities() if one.of_waypoint is not None}
    return {key: value for key, value in values.items() if value is not None}


@lru_cache(maxsize=4)
def _others(path: tuple[str, ...]) -> tuple[Quantity, ...]:  # noqa: ARG001 what is registered depends on it
    found = []
    for name, entry in registered(GROUP).items():
        try:
            other = entry.load()
        except Exception as error:
            raise InputError(f"quantity '{name}' ({entry.value}) cannot be loaded: {error}") from error
        if not isinstance(other, Quantity) or other.key != name:
            raise InputError(f"quantity '{name}' ({entry.value}): expected a Quantity whose key bears this name")
        if name in {one.key for one in _OURS}:
            raise InputError(f"quantity '{name}' ({entry.value}): the name is taken")
        found.append(other)
    return tuple(found)
