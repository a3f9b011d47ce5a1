"""Goals for a place that has none: far from one another, clear of walls, in an order that makes a short tour."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from taskslam.errors import ScenarioError
from taskslam.geometry import SE2, FloatArray
from taskslam.navigation.costmap import GlobalCostmap
from taskslam.navigation.global_planner import plan_path, travel_costs
from taskslam.navigation.settings import NavigationSettings
from taskslam.robot import Robot
from taskslam.scenario.checks import clearance_map
from taskslam.task import Waypoint
from taskslam.world import FloorPlan
from taskslam.world.floor_plan import FREE

CLEARANCE = 0.5  # m; as much as the goals of the built-in places keep
_APART = 1.0  # m on the way between two goals, at least
_LAST_PART = 0.5  # m of the way, along which a goal looks


def propose_start(plan: FloorPlan, robot: Robot) -> Waypoint:
    """The most open place of the largest floor on which the robot can drive; it looks along x.

    Floor that reaches the edge of the plan, as the ground around a building does, is taken only where nothing else is.

    Raises ScenarioError if there is no place for the robot.
    """
    clearance = np.where(plan.cells == FREE, clearance_map(plan), 0.0)
    regions, count = ndimage.label(clearance > robot.footprint.radius, structure=np.ones((3, 3)))
    if count == 0:
        raise ScenarioError(
            f"the floor plan has no free place for a robot of {2 * robot.footprint.radius:.2f} m diameter"
        )
    sizes = np.bincount(regions.ravel(), minlength=count + 1)
    outer = np.unique(np.concatenate([regions[0], regions[-1], regions[:, 0], regions[:, -1]]))
    sizes[0] = 0
    if len(np.setdiff1d(np.arange(1, count + 1), outer)):
        sizes[outer] = 0
    largest = int(np.argmax(sizes))
    clear = np.where(regions == largest, np.minimum(clearance, 1e6), 0.0)
    x, y = _point(plan, np.unravel_index(int(np.argmax(clear)), clear.shape))
    return Waypoint(x=x, y=y, theta=0.0)


def propose_goals(
    plan: FloorPlan, robot: Robot, start: Waypoint, count: int, clearance: float = CLEARANCE
) -> tuple[Waypoint, ...]:
    """So many goals that can be reached from `start`, each as far as can be from those before it, on the robot's ways.

    clearance: m from the nearest obstacle, and never less than the robot needs. Their order is that of a short tour
    (nearest first, then 2-opt), and each looks in the direction in which the robot comes. The same for the same plan.

    Raises ScenarioError if so many do not fit.
    """
    settings = NavigationSettings()
    costmap = GlobalCostmap(plan, settings.costmap)
    least = max(clearance, robot.footprint.radius + plan.resolution)
    fit = (plan.cells == FREE) & (clearance_map(plan) >= least)
    apart = _APART / plan.resolution * settings.global_planner.neutral_cost
    chosen: list[tuple[int, int]] = []
    costs = [travel_costs(costmap, start.pose, settings.global_planner)]
    nearest = costs[0]
    while len(chosen) < count:
        far = np.where(fit & np.isfinite(nearest), nearest, -1.0)
        cell = tuple(int(i) for i in np.unravel_index(int(np.argmax(far)), far.shape))
        if far[cell] < apart:
            raise ScenarioError(
                f"{len(chosen)} goals fit on this floor plan, {least:.2f} m clear of walls, reached from"
                f" ({start.x:g}, {start.y:g}) and {_APART:g} m apart; expected {count}: ask for fewer or nearer ones"
            )
        chosen.append((cell[0], cell[1]))
        costs.append(travel_costs(costmap, SE2(*_point(plan, cell)), settings.global_planner))
        nearest = np.minimum(nearest, costs[-1])
    between = np.array([[cost[cell] for cell in chosen] for cost in costs])  # from the start and each goal to each goal
    order = _short_tour(between)
    goals, at = [], start.pose
    for index in order:
        x, y = _point(plan, chosen[index])
        path = plan_path(costmap, at, SE2(x, y), settings.global_planner)
        at = SE2(x, y, 0.0 if path is None else _arrival(path))
        goals.append(Waypoint(x=x, y=y, theta=round(at.theta, 2)))
    return tuple(goals)


def _point(plan: FloorPlan, cell: npt.ArrayLike) -> tuple[float, float]:
    (x, y), *_ = plan.points_of(np.asarray([cell], dtype=np.int64))
    return round(float(x), 3), round(float(y), 3)


def _arrival(path: FloatArray) -> float:
    """Direction of the last part of a path, rad."""
    left = np.linalg.norm(path - path[-1], axis=1)
    before = path[np.flatnonzero(left >= min(_LAST_PART, left.max()))[-1]]
    dx, dy = path[-1] - before
    return math.atan2(dy, dx)


def _short_tour(between: FloatArray) -> list[int]:
    """An order of goals. between: (1 + N, N) costs from the start (row 0) and from goal i (row 1 + i) to each goal."""
    left, order, row = set(range(between.shape[1])), [], 0
    while left:
        best = min(sorted(left), key=lambda goal: between[row, goal])
        left.remove(best)
        order.append(best)
        row = 1 + best

    def cost(tour: list[int]) -> float:
        rows = [0, *(1 + goal for goal in tour[:-1])]
        return float(between[rows, tour].sum())

    better = True
    while better:
        better = False
        for i in range(len(order) - 1):
            for j in range(i + 1, len(order)):
                turned = order[:i] + order[i : j + 1][::-1] + order[j + 1 :]
                if cost(turned) < cost(order) - 1e-9:
                    order, better = turned, True
    return order
