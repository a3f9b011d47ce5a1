"""The cumulative precision curve and the area under it, N-AUC (protocol 5.4).

    y(x) = #{complete waypoints with E < x} / #{planned waypoints}

Incomplete waypoints never enter the numerator, so the curve levels off at the completeness. The published N-AUC is a
trapezoid over a coarse grid and cannot reach 1; the exact one is the integral of the step curve itself and can.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from taskslam.evaluation.metrics_file import NormalizedArea
from taskslam.geometry import FloatArray

# In metres; whole centimetres divided by 100, so that a value on the grid compares as it does in the publication.
SIMULATION_GRID: FloatArray = np.arange(0, 121, 15) / 100  # 4 D; the largest attainable N-AUC is 0.9375
REAL_GRID: FloatArray = np.arange(0, 91, 6) / 100  # 3 D; the largest attainable N-AUC is 0.9667
EXACT_RANGE = 1.20


def cumulative_precision(precisions: npt.ArrayLike, planned: int, grid: npt.ArrayLike) -> FloatArray:
    """(G,) share of planned waypoints, 0 to 1, that are complete with E strictly below each of (G,) metres.

    precisions: E in metres of the complete waypoints only; NaN is refused. planned: number of planned waypoints.
    Raises ValueError if there are more precisions than planned waypoints, or one that is not finite.
    """
    values = _checked(precisions, planned)
    below = values[None, :] < np.asarray(grid, dtype=np.float64)[:, None]
    return np.asarray(below.sum(axis=1) / planned, dtype=np.float64)


def n_auc_on_grid(precisions: npt.ArrayLike, planned: int, grid: FloatArray = SIMULATION_GRID) -> float:
    """Area under the curve by trapezoids over a grid in metres, divided by its length: the published N-AUC (5.4)."""
    y = cumulative_precision(precisions, planned, grid)
    return float(np.sum((y[1:] + y[:-1]) / 2 * np.diff(grid)) / (grid[-1] - grid[0]))


def n_auc_exact(precisions: npt.ArrayLike, planned: int, limit: float = EXACT_RANGE) -> float:
    """Area under the curve without a grid: mean over planned waypoints of max(0, limit - E) / limit (5.4).

    limit: right end of the curve in metres. An incomplete waypoint adds nothing.
    """
    return float(np.maximum(0.0, 1.0 - _checked(precisions, planned) / limit).sum() / planned)


def normalized_area(precisions: Sequence[float | None], planned: int) -> NormalizedArea:
    """Every N-AUC of the complete waypoints, whose E in metres is None where it is not known.

    Without a true pose, or with one round, a complete waypoint has no E. It is neither on the curve nor missed, so then
    there is no area at all; without any complete waypoint it is 0.
    """
    values = [value for value in precisions if value is not None]
    if len(values) < len(precisions):
        return NormalizedArea(published=None, published_real_grid=None, exact=None)
    return NormalizedArea(
        published=n_auc_on_grid(values, planned, SIMULATION_GRID),
        published_real_grid=n_auc_on_grid(values, planned, REAL_GRID),
        exact=n_auc_exact(values, planned),
    )


def _checked(precisions: npt.ArrayLike, planned: int) -> FloatArray:
    values = np.asarray(precisions, dtype=np.float64).reshape(-1)
    if planned < 1 or len(values) > planned:
        raise ValueError(f"{len(values)} precisions for {planned} planned waypoints; expected at most one each")
    if not np.isfinite(values).all():
        raise ValueError("precisions must be finite; leave incomplete waypoints out")
    return values
