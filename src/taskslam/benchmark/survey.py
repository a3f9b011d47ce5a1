"""A tour before it is driven: what way the robot would take, how near to walls, and what is wrong with it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from taskslam.geometry import SE2, FloatArray
from taskslam.navigation.costmap import GlobalCostmap
from taskslam.navigation.global_planner import plan_path
from taskslam.navigation.settings import NavigationSettings
from taskslam.robot import Robot
from taskslam.scenario import Scenario
from taskslam.scenario.checks import clearance_map, faults_of_places
from taskslam.world import FloorPlan


@dataclass(frozen=True)
class Leg:
    """The way to one goal, from the start or the goal before it.

    path: (N, 2) points in `map`, as planned on the empty plan; None where there is no way. clearance_m: from the goal
    to the nearest obstacle, inf without obstacles, nan outside the plan; narrowest_m: the same, at the narrowest of
    the way. fault: what is wrong with the goal, in a sentence; empty if nothing is.
    """

    goal: SE2
    path: FloatArray | None
    clearance_m: float
    narrowest_m: float
    fault: str

    @property
    def length_m(self) -> float | None:
        """Of the way."""
        return None if self.path is None else float(np.linalg.norm(np.diff(self.path, axis=0), axis=1).sum())


@dataclass(frozen=True)
class Survey:
    """A tour's legs. start_fault: what is wrong with the start."""

    start: SE2
    start_fault: str
    legs: tuple[Leg, ...]

    @property
    def faults(self) -> tuple[str, ...]:
        """All that is wrong."""
        return tuple(fault for fault in (self.start_fault, *(leg.fault for leg in self.legs)) if fault)

    @property
    def length_m(self) -> float:
        """Of the tour, as far as there is a way."""
        return sum(leg.length_m or 0.0 for leg in self.legs)

    @property
    def clearance_m(self) -> float:
        """Least of the goals with a way to them; inf without any."""
        return min((leg.clearance_m for leg in self.legs if leg.path is not None), default=math.inf)

    @property
    def narrowest_m(self) -> float:
        """The narrowest place of all ways; inf without any."""
        return min((leg.narrowest_m for leg in self.legs if leg.path is not None), default=math.inf)


def survey(scenario: Scenario, plan: FloorPlan, robot: Robot) -> Survey:
    """Look at every goal and plan the way to it with the benchmark's own planner, on the floor plan as it is.

    A goal that is no place for the robot is passed by: the way to the next one begins where the robot then is.
    """
    settings = NavigationSettings()
    costmap = GlobalCostmap(plan, settings.costmap)
    clearance = clearance_map(plan)
    start_fault, *faults = faults_of_places(scenario, plan, robot)
    at = scenario.start.pose
    legs: list[Leg] = []
    for goal, found in zip(scenario.sequence.goals, faults, strict=True):
        fault, path = found, None
        if not fault and not start_fault:
            path = plan_path(costmap, at, goal.pose, settings.global_planner)
            if path is None:
                fault = f"goal {len(legs) + 1} at ({goal.x:g}, {goal.y:g}): the planner finds no way to it"
            else:
                at = goal.pose
        here = _clearances(clearance, plan, np.array([[goal.x, goal.y]]))[0]
        narrowest = here if path is None else float(_clearances(clearance, plan, path).min())
        legs.append(Leg(goal.pose, path, float(here), narrowest, fault))
    return Survey(scenario.start.pose, start_fault, tuple(legs))


def _clearances(clearance: FloatArray, plan: FloorPlan, points: FloatArray) -> FloatArray:
    cells = plan.cells_of(points)
    inside = ((cells >= 0) & (cells < plan.cells.shape)).all(axis=1)
    found = np.full(len(points), np.nan)
    found[inside] = clearance[tuple(cells[inside].T)]
    return found
