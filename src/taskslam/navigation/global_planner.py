"""The global planner: shortest path on the inflated grid (protocol 3.4).

GlobalPlanner's Dijkstra with the quadratic potential is a first-order solution of the eikonal equation
|grad u| = cost, u(start) = 0, from the start outwards; the path follows the gradient from the goal back. We solve the
same equation with its exact upwind update (Sethian 1996, fast marching) instead of navfn's polynomial fit to it.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import SE2, FloatArray, transform_points
from taskslam.navigation.costmap import GlobalCostmap
from taskslam.navigation.settings import GlobalPlannerSettings

Grid = npt.NDArray[np.uint8]
_NOWHERE = (-1, -1)  # a goal that is never come to: every cell is


def plan_path(costmap: GlobalCostmap, start: SE2, goal: SE2, settings: GlobalPlannerSettings) -> FloatArray | None:
    """(N, 2) points in `map` from start to goal, half a cell apart, or None when there is no way.

    A cell costs min(neutral + factor * c, lethal - 1); cells with c >= lethal - 1 are closed, save the start's.
    """
    start_cell, goal_cell = costmap.cell_of(start.x, start.y), costmap.cell_of(goal.x, goal.y)
    if start_cell is None or goal_cell is None:
        return None
    potential = _potential(
        costmap.cost, *start_cell, *goal_cell,
        settings.neutral_cost, settings.cost_factor, settings.lethal_cost,
    )  # fmt: skip
    if not math.isfinite(potential[goal_cell]):
        return None
    T_grid_map = costmap.origin.inverse()
    s, g = T_grid_map @ start, T_grid_map @ goal
    r = costmap.resolution
    backwards = _descend(potential, s.x / r - 0.5, s.y / r - 0.5, g.x / r - 0.5, g.y / r - 0.5)
    points = transform_points(costmap.origin, (backwards[::-1] + 0.5) * r)
    points[0] = start.x, start.y
    points[-1] = goal.x, goal.y
    return points


def travel_costs(costmap: GlobalCostmap, start: SE2, settings: GlobalPlannerSettings) -> FloatArray:
    """(rows, columns) what it costs to come from `start` to each cell, as paths are planned; inf: there is no way."""
    cell = costmap.cell_of(start.x, start.y)
    if cell is None:
        return np.full(costmap.cost.shape, np.inf)
    costs: FloatArray = _potential(
        costmap.cost, *cell, *_NOWHERE, settings.neutral_cost, settings.cost_factor, settings.lethal_cost
    )
    return costs


@njit(cache=True)
def _potential(
    cost: Grid, row0: int, column0: int, row1: int, column1: int, neutral: float, factor: float, lethal: float
) -> FloatArray:
    """(rows, columns) potential from the start cell; inf where not reached before the goal's surroundings are final."""
    rows, columns = cost.shape
    u = np.full((rows, columns), np.inf)
    done = np.zeros((rows, columns), np.bool_)
    # a binary heap with stale entries left in: a cell is pushed at most once for each of its four neighbours
    heap_key = np.empty(4 * rows * columns + 1)
    heap_cell = np.empty(4 * rows * columns + 1, np.int32)
    u[row0, column0] = 0.0
    heap_key[0], heap_cell[0] = 0.0, row0 * columns + column0
    size = 1
    stop_at = np.inf
    while size > 0:
        key, cell = heap_key[0], heap_cell[0]
        size -= 1
        last_key, last_cell = heap_key[size], heap_cell[size]
        i = 0
        while True:
            child = 2 * i + 1
            if child >= size:
                break
            if child + 1 < size and heap_key[child + 1] < heap_key[child]:
                child += 1
            if heap_key[child] >= last_key:
                break
            heap_key[i], heap_cell[i] = heap_key[child], heap_cell[child]
            i = child
        heap_key[i], heap_cell[i] = last_key, last_cell
        r, c = cell // columns, cell % columns
        if done[r, c]:
            continue
        if key > stop_at:
            break
        done[r, c] = True
        if r == row1 and c == column1:
            stop_at = key + 2.0 * lethal  # the descent starts between the goal's neighbours: finish those too
        for k in range(4):
            nr = r + (1 if k == 0 else -1 if k == 1 else 0)
            nc = c + (1 if k == 2 else -1 if k == 3 else 0)
            if nr < 0 or nc < 0 or nr >= rows or nc >= columns or done[nr, nc] or cost[nr, nc] >= lethal - 1:
                continue
            h = min(neutral + factor * cost[nr, nc], lethal - 1)
            a = min(u[nr - 1, nc] if nr > 0 else np.inf, u[nr + 1, nc] if nr + 1 < rows else np.inf)
            b = min(u[nr, nc - 1] if nc > 0 else np.inf, u[nr, nc + 1] if nc + 1 < columns else np.inf)
            low, high = min(a, b), max(a, b)
            d = high - low
            value = low + h if d >= h else 0.5 * (low + high + math.sqrt(2.0 * h * h - d * d))
            if value < u[nr, nc]:
                u[nr, nc] = value
                i = size
                size += 1
                while i > 0:
                    parent = (i - 1) // 2
                    if heap_key[parent] <= value:
                        break
                    heap_key[i], heap_cell[i] = heap_key[parent], heap_cell[parent]
                    i = parent
                heap_key[i], heap_cell[i] = value, nr * columns + nc
    return u


@njit(cache=True)
def _slope(u: FloatArray, r: int, c: int) -> tuple[float, float]:
    """Upwind gradient (d/dcolumn, d/drow) of the potential at a cell; zero where the cell was not reached."""
    rows, columns = u.shape
    here = u[r, c]
    if not math.isfinite(here):
        return 0.0, 0.0
    left = u[r, c - 1] if c > 0 else np.inf
    right = u[r, c + 1] if c + 1 < columns else np.inf
    below = u[r - 1, c] if r > 0 else np.inf
    above = u[r + 1, c] if r + 1 < rows else np.inf
    gx = 0.0
    if min(left, right) < here:
        gx = here - left if left <= right else right - here
    gy = 0.0
    if min(below, above) < here:
        gy = here - below if below <= above else above - here
    return gx, gy


@njit(cache=True)
def _descend(u: FloatArray, sx: float, sy: float, gx: float, gy: float) -> FloatArray:
    """(N, 2) points column, row (cell centres at whole numbers) from the goal down to the start, half a cell apart."""
    rows, columns = u.shape
    path = np.empty((2 * rows * columns + 16, 2))
    path[0, 0], path[0, 1] = gx, gy
    n = 1
    x, y = gx, gy
    in_cell = 0
    while math.hypot(x - sx, y - sy) > 1.0 and n < len(path) - 1:
        r, c = min(max(round(y), 0), rows - 1), min(max(round(x), 0), columns - 1)
        if u[r, c] == 0.0:
            break
        r0, c0 = math.floor(y), math.floor(x)
        fy, fx = y - r0, x - c0
        dx, dy = 0.0, 0.0
        for k in range(4):
            kr, kc = r0 + k // 2, c0 + k % 2
            if kr < 0 or kc < 0 or kr >= rows or kc >= columns:
                continue
            weight = (fy if k // 2 else 1.0 - fy) * (fx if k % 2 else 1.0 - fx)
            px, py = _slope(u, kr, kc)
            dx += weight * px
            dy += weight * py
        norm = math.hypot(dx, dy)
        moved = False
        if norm > 1e-9 and in_cell < 4:
            nx, ny = x - 0.5 * dx / norm, y - 0.5 * dy / norm
            nr, nc = round(ny), round(nx)
            if 0 <= nr < rows and 0 <= nc < columns and u[nr, nc] <= u[r, c]:
                in_cell = in_cell + 1 if (nr == r and nc == c) else 0
                x, y = nx, ny
                moved = True
        if not moved:
            # the blend of slopes points uphill (a corner): go to the lowest neighbour's centre, always downhill
            br, bc = r, c
            for kr in range(max(r - 1, 0), min(r + 2, rows)):
                for kc in range(max(c - 1, 0), min(c + 2, columns)):
                    if u[kr, kc] < u[br, bc]:
                        br, bc = kr, kc
            if br == r and bc == c:
                break
            x, y = float(bc), float(br)
            in_cell = 0
        path[n, 0], path[n, 1] = x, y
        n += 1
    path[n, 0], path[n, 1] = sx, sy
    return path[: n + 1].copy()
