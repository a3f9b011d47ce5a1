"""The floor plan of a run, and which part of `map` a drawing of it shows."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from taskslam.errors import FloorPlanError
from taskslam.geometry import FloatArray
from taskslam.world import FloorPlan
from taskslam.world.floor_plan import UNKNOWN
from taskslam.world.map_server import load_floor_plan

_MARGIN = 0.6  # m around what is drawn


def floor_plan(run: Path) -> FloorPlan | None:
    """The run's own copy of the floor plan; a run without a readable one is drawn on white."""
    try:
        return load_floor_plan(run / "plan.yaml")
    except FloorPlanError:
        return None


def extent(plan: FloorPlan | None, points: Iterable[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner in `map` of the known floor and of all (N, 2) or (N, 3) points, with a margin."""
    everything = [array[:, :2] for array in points]
    if plan is not None:
        rows, columns = np.nonzero(plan.cells != UNKNOWN)
        if len(rows):
            box = [(r, c) for r in (rows.min(), rows.max() + 1) for c in (columns.min(), columns.max() + 1)]
            everything.append(plan.points_of(np.array(box, dtype=np.int64)))
    joined = np.concatenate(everything)
    return joined.min(axis=0) - _MARGIN, joined.max(axis=0) + _MARGIN
