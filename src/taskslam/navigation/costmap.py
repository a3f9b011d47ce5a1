"""The two layered costmaps that the planners see (protocol 3.3).

Both hold the floor plan *and* the scan. The floor plan is tied to the robot by the SLAM estimate, the scan by what the
robot sees: when the estimate drifts, walls appear twice, doors narrow, and navigation fails. That is how SLAM error
becomes task failure, so neither layer may be left out of either map.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit
from taskslam.geometry import SE2, FloatArray
from taskslam.navigation.inflation import INSCRIBED, LETHAL, inflate, inflation_costs
from taskslam.navigation.obstacle_layer import Grid, PlacedScan, clear_and_mark, clear_disc
from taskslam.navigation.settings import CostmapSettings
from taskslam.world.floor_plan import OCCUPIED, UNKNOWN, FloorPlan


def static_layer(plan: FloorPlan, settings: CostmapSettings) -> Grid:
    """(rows, columns) of the plan: LETHAL where occupied (and where unknown, unless `unknown_is_free`), else 0."""
    lethal = plan.cells == OCCUPIED
    if not settings.unknown_is_free:
        lethal |= plan.cells == UNKNOWN
    return np.where(lethal, np.uint8(LETHAL), np.uint8(0))


class GlobalCostmap:
    """The whole floor plan in frame `map`, at its own resolution.

    cost: (rows, columns) uint8, indexed like the plan's cells.
    """

    def __init__(self, plan: FloorPlan, settings: CostmapSettings) -> None:
        self._settings = settings
        self._plan = plan
        self._T_grid_map = plan.origin.inverse()
        self._static = static_layer(plan, settings)
        self._reach, self._costs = inflation_costs(settings, plan.resolution)
        self.resolution = plan.resolution
        self.cost = np.zeros_like(self._static)
        inflate(self._static, self.cost, 0, self.cost.shape[0], 0, self.cost.shape[1], self._reach, self._costs)
        self._static_cost = self.cost.copy()
        self._marks = np.zeros_like(self._static)

    def reset(self) -> None:
        """Forget every scan; the floor plan stays."""
        self._marks[:] = 0
        self.cost[:] = self._static_cost

    def update(self, scan: PlacedScan | None, T_map_base: SE2) -> None:
        """Take in the newest scan and renew the costs around it."""
        s, resolution = self._settings, self.resolution
        laser = self._T_grid_map @ (scan.T_map_laser if scan is not None else T_map_base)
        if scan is not None:
            clear_and_mark(
                self._marks, laser.x, laser.y, laser.theta, scan.angles, scan.ranges, resolution,
                s.obstacle_range, s.raytrace_range, s.clearing_margin_cells * resolution,
            )  # fmt: skip
        base = self._T_grid_map @ T_map_base
        clear_disc(self._marks, base.x, base.y, s.robot_radius, resolution)
        rows, columns = self.cost.shape
        around = max(s.raytrace_range, s.obstacle_range) + s.inflation_radius + 2 * resolution
        around += math.hypot(base.x - laser.x, base.y - laser.y)
        row0, row1 = _window(laser.y - around, laser.y + around, resolution, rows)
        column0, column1 = _window(laser.x - around, laser.x + around, resolution, columns)
        if row0 < row1 and column0 < column1:
            layers = np.maximum(self._static, self._marks)
            inflate(layers, self.cost, row0, row1, column0, column1, self._reach, self._costs)

    def cell_of(self, x: float, y: float) -> tuple[int, int] | None:
        """(row, column) of a point in `map`, or None outside the plan."""
        p = self._T_grid_map @ SE2(x, y)
        row, column = math.floor(p.y / self.resolution), math.floor(p.x / self.resolution)
        inside = 0 <= row < self.cost.shape[0] and 0 <= column < self.cost.shape[1]
        return (row, column) if inside else None

    @property
    def origin(self) -> SE2:
        """`T_map_grid`: the outer corner of cell (0, 0) in `map`."""
        return self._plan.origin


class LocalCostmap:
    """A square that rolls with the robot in frame `odom`; the floor plan is projected into it through `T_map_odom`.

    cost, layers: (n, n) uint8; row 0 is the lowest y. `layers` is before inflation: LETHAL or 0.
    """

    def __init__(self, plan: FloorPlan, settings: CostmapSettings) -> None:
        self._settings = settings
        self._T_grid_map = plan.origin.inverse()
        self._plan_resolution = plan.resolution
        self._static = static_layer(plan, settings)
        self.resolution = settings.local_resolution
        self.size = round(settings.local_size / self.resolution)
        self._reach, self._costs = inflation_costs(settings, self.resolution)
        self._marks = np.zeros((self.size, self.size), np.uint8)
        self._corner = (0, 0)
        self.layers = np.zeros_like(self._marks)
        self.cost = np.zeros_like(self._marks)

    def reset(self) -> None:
        """Forget every scan."""
        self._marks[:] = 0
        self.layers[:] = 0
        self.cost[:] = 0

    @property
    def origin(self) -> tuple[float, float]:
        """The corner of cell (0, 0) in `odom`, m."""
        return self._corner[1] * self.resolution, self._corner[0] * self.resolution

    def update(self, scan: PlacedScan | None, T_map_odom: SE2, T_odom_base: SE2) -> None:
        """Roll to the robot, take in the newest scan, project the floor plan, inflate."""
        s = self._settings
        self._roll_to(T_odom_base.x, T_odom_base.y)
        x0, y0 = self.origin
        if scan is not None:
            laser = scan.T_odom_laser
            clear_and_mark(
                self._marks, laser.x - x0, laser.y - y0, laser.theta, scan.angles, scan.ranges, self.resolution,
                s.obstacle_range, s.raytrace_range, s.clearing_margin_cells * self.resolution,
            )  # fmt: skip
        clear_disc(self._marks, T_odom_base.x - x0, T_odom_base.y - y0, s.robot_radius, self.resolution)
        T_grid_odom = self._T_grid_map @ T_map_odom
        _project(
            self._static, self._plan_resolution, T_grid_odom.x, T_grid_odom.y, T_grid_odom.theta,
            x0, y0, self.resolution, self._marks, self.layers,
        )  # fmt: skip
        inflate(self.layers, self.cost, 0, self.size, 0, self.size, self._reach, self._costs)

    def obstacles(self, T_odom_base: SE2, behind: float) -> FloatArray:
        """(M, 2) centres in `odom` of the lethal cells that have a free neighbour, none more than `behind` m behind."""
        x0, y0 = self.origin
        heading = (math.cos(T_odom_base.theta), math.sin(T_odom_base.theta))
        points: FloatArray = _surface(
            self.layers, x0, y0, self.resolution, T_odom_base.x, T_odom_base.y, *heading, behind
        )  # fmt: skip
        return points

    def cost_at(self, x: float, y: float) -> int:
        """The cost at a point in `odom`; LETHAL outside the window."""
        x0, y0 = self.origin
        row, column = math.floor((y - y0) / self.resolution), math.floor((x - x0) / self.resolution)
        inside = 0 <= row < self.size and 0 <= column < self.size
        return int(self.cost[row, column]) if inside else LETHAL

    def _roll_to(self, x: float, y: float) -> None:
        half = self.size // 2
        row, column = math.floor(y / self.resolution) - half, math.floor(x / self.resolution) - half
        d_row, d_column = row - self._corner[0], column - self._corner[1]
        if d_row == 0 and d_column == 0:
            return
        kept = np.zeros_like(self._marks)
        n = self.size
        if abs(d_row) < n and abs(d_column) < n:
            to_rows, from_rows = _overlap(d_row, n)
            to_columns, from_columns = _overlap(d_column, n)
            kept[to_rows, to_columns] = self._marks[from_rows, from_columns]
        self._marks = kept
        self._corner = (row, column)


def blocked(cost: Grid) -> npt.NDArray[np.bool_]:
    """Where the robot's centre may not be: within the inscribed radius of something lethal."""
    return cost >= INSCRIBED


def _window(low: float, high: float, resolution: float, cells: int) -> tuple[int, int]:
    return max(math.floor(low / resolution), 0), min(math.floor(high / resolution) + 1, cells)


def _overlap(shift: int, n: int) -> tuple[slice, slice]:
    """Slices (to, from) that move a window of n cells by `shift`."""
    if shift >= 0:
        return slice(0, n - shift), slice(shift, n)
    return slice(-shift, n), slice(0, n + shift)


@njit(cache=True)
def _project(
    static: Grid,
    plan_resolution: float,
    x: float,
    y: float,
    theta: float,
    x0: float,
    y0: float,
    resolution: float,
    marks: Grid,
    layers: Grid,
) -> None:
    """Set `layers` to the larger of `marks` and the plan at each local cell's centre; (x, y, theta): T_grid_odom."""
    c, s = math.cos(theta), math.sin(theta)
    rows, columns = static.shape
    for i in range(layers.shape[0]):
        oy = y0 + (i + 0.5) * resolution
        for j in range(layers.shape[1]):
            ox = x0 + (j + 0.5) * resolution
            column = math.floor((x + c * ox - s * oy) / plan_resolution)
            row = math.floor((y + s * ox + c * oy) / plan_resolution)
            value = marks[i, j]
            if 0 <= row < rows and 0 <= column < columns and static[row, column] > value:
                value = static[row, column]
            layers[i, j] = value


@njit(cache=True)
def _surface(
    layers: Grid,
    x0: float,
    y0: float,
    resolution: float,
    x: float,
    y: float,
    ux: float,
    uy: float,
    behind: float,
) -> FloatArray:
    rows, columns = layers.shape
    found = np.empty((rows * columns, 2))
    count = 0
    for r in range(rows):
        for c in range(columns):
            if layers[r, c] != 254:
                continue
            hidden = (
                (r == 0 or layers[r - 1, c] == 254)
                and (r == rows - 1 or layers[r + 1, c] == 254)
                and (c == 0 or layers[r, c - 1] == 254)
                and (c == columns - 1 or layers[r, c + 1] == 254)
            )
            if hidden:
                continue
            px, py = x0 + (c + 0.5) * resolution, y0 + (r + 0.5) * resolution
            if (px - x) * ux + (py - y) * uy < -behind:
                continue
            found[count, 0] = px
            found[count, 1] = py
            count += 1
    return found[:count].copy()
