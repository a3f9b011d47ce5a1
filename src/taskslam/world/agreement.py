"""How far two floor plans of the same place agree, whatever their grids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from taskslam.world.floor_plan import FREE, OCCUPIED, FloorPlan


@dataclass(frozen=True)
class Agreement:
    """Shares in 0..1; NaN where a plan has no such cell.

    occupied_a: occupied cells of a with an occupied cell of b within the tolerance; occupied_b: the other way round;
    free_a: free cells of a whose centre is free in b; free_b: the other way round.
    """

    occupied_a: float
    occupied_b: float
    free_a: float
    free_b: float


def agreement(plan_a: FloorPlan, plan_b: FloorPlan, tolerance_m: float = 0.15) -> Agreement:
    """Compare two plans in the same frame `map`; distances are between cell centres, in metres."""
    return Agreement(
        occupied_a=_occupied_near(plan_a, plan_b, tolerance_m),
        occupied_b=_occupied_near(plan_b, plan_a, tolerance_m),
        free_a=_free_in(plan_a, plan_b),
        free_b=_free_in(plan_b, plan_a),
    )


def _occupied_near(plan: FloorPlan, other: FloorPlan, tolerance: float) -> float:
    mine = plan.points_of(np.argwhere(plan.cells == OCCUPIED))
    theirs = other.points_of(np.argwhere(other.cells == OCCUPIED))
    if len(mine) == 0:
        return float("nan")
    if len(theirs) == 0:
        return 0.0
    distance, _ = cKDTree(theirs).query(mine, distance_upper_bound=tolerance * (1 + 1e-9))
    return float(np.mean(np.isfinite(distance)))


def _free_in(plan: FloorPlan, other: FloorPlan) -> float:
    cells = other.cells_of(plan.points_of(np.argwhere(plan.cells == FREE)))
    if len(cells) == 0:
        return float("nan")
    inside = ((cells >= 0) & (cells < other.cells.shape)).all(axis=1)
    rows, columns = cells[inside].T
    return float(np.count_nonzero(other.cells[rows, columns] == FREE) / len(cells))
