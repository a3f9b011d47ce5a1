"""The inflation layer: cost by exact euclidean distance to the nearest lethal cell, on a window of a grid.

Costs follow costmap_2d: 254 occupied, 253 within the inscribed radius, then 252 exp(-k (d - inscribed)) up to the
inflation radius. Unknown cells are free or lethal before they come here (`CostmapSettings.unknown_is_free`).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.navigation.settings import CostmapSettings

Grid = npt.NDArray[np.uint8]

FREE_SPACE, INSCRIBED, LETHAL = 0, 253, 254


def inflation_costs(settings: CostmapSettings, resolution: float) -> tuple[int, Grid]:
    """Reach of the inflation in cells, and the cost by squared distance in cells (protocol 3.3)."""
    reach = int(np.ceil(settings.inflation_radius / resolution - 1e-9))
    distance = np.sqrt(np.arange(reach * reach + 1, dtype=np.float64)) * resolution
    # costmap_2d truncates to a whole number; the exponential is nowhere below zero inside the radius
    cost = np.floor(252.0 * np.exp(-settings.cost_scaling_factor * (distance - settings.robot_radius)))
    cost[distance <= settings.robot_radius + 1e-9] = INSCRIBED
    cost[0] = LETHAL
    cost[distance > settings.inflation_radius + 1e-9] = FREE_SPACE
    return reach, cost.astype(np.uint8)


@njit(cache=True)
def inflate(
    layers: Grid, master: Grid, row0: int, row1: int, column0: int, column1: int, reach: int, costs: Grid
) -> None:
    """Write the costs of rows row0..row1-1, columns column0..column1-1 of `master` from the cells in `layers`.

    layers: (rows, columns) of FREE_SPACE or LETHAL. Two passes: distance along the column, then the
    lower envelope along the row within `reach` (Meijster et al. 2000 without its second
    scan: exact, and quick for a short reach).
    """
    rows, columns = layers.shape
    left, right = max(column0 - reach, 0), min(column1 + reach, columns)
    top, bottom = max(row0 - reach, 0), min(row1 + reach, rows)
    far = reach + 1
    vertical = np.full((row1 - row0, right - left), far, np.int32)
    for c in range(left, right):
        last = -10 * far
        for r in range(top, row1):
            if layers[r, c] == 254:
                last = r
            if r >= row0 and r - last < far:
                vertical[r - row0, c - left] = r - last
        last = bottom + 10 * far
        for r in range(bottom - 1, row0 - 1, -1):
            if layers[r, c] == 254:
                last = r
            if r < row1 and last - r < vertical[r - row0, c - left]:
                vertical[r - row0, c - left] = last - r
    limit = reach * reach
    nearest = np.empty(column1 - column0, np.int32)
    for r in range(row0, row1):
        nearest[:] = limit + 1
        for c in range(left, right):
            v = vertical[r - row0, c - left]
            if v > reach:
                continue
            v2 = v * v
            for k in range(max(c - reach, column0), min(c + reach + 1, column1)):
                d2 = v2 + (k - c) * (k - c)
                if d2 < nearest[k - column0]:
                    nearest[k - column0] = d2
        for c in range(column0, column1):
            d2 = nearest[c - column0]
            master[r, c] = costs[d2] if d2 <= limit else 0
