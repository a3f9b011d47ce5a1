"""Does the tour fit the floor plan? Start and goals free, far enough from walls, and connected for this robot."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from taskslam.errors import FloorPlanError, ScenarioError
from taskslam.robot import Robot
from taskslam.scenario.scenario import Scenario
from taskslam.task import Waypoint
from taskslam.world import FloorPlan, World
from taskslam.world.floor_plan import OCCUPIED
from taskslam.world.slicing import slab_polygons


def check_scenario(scenario: Scenario, plan: FloorPlan, world: World | None, robot: Robot) -> None:
    """Complain before the robot moves rather than after.

    Raises:
        FloorPlanError: plan and world do not overlap.
        ScenarioError: the start or a goal lies outside the plan, in or too near to a wall, or cannot be reached.
    """
    if world is not None:
        _check_overlap(plan, world, robot)
    for fault in faults_of_places(scenario, plan, robot):
        if fault:
            raise ScenarioError(fault)


def faults_of_places(scenario: Scenario, plan: FloorPlan, robot: Robot) -> list[str]:
    """What is wrong with the start and with every goal, in this order; empty where nothing is."""
    clearance = clearance_map(plan)
    places = [("the start", scenario.start)]
    places += [(f"goal {number}", goal) for number, goal in enumerate(scenario.sequence.goals, start=1)]
    radius = robot.footprint.radius
    regions, _ = ndimage.label(clearance > radius, structure=np.ones((3, 3)))
    faults: list[str] = []
    for what, place in places:
        fault = _fault_of_place(what, place, plan, clearance, radius)
        # from a start that is no place nothing is reachable, which would be said of every goal
        if (
            not fault
            and not (faults and faults[0])
            and regions[_cell(plan, place)] != regions[_cell(plan, scenario.start)]
        ):
            fault = (
                f"{what} at ({place.x:g}, {place.y:g}) cannot be reached from the start at ({scenario.start.x:g},"
                f" {scenario.start.y:g}): no way for a robot of {2 * radius:.2f} m diameter on the floor plan"
            )
        faults.append(fault)
    return faults


def clearance_map(plan: FloorPlan) -> npt.NDArray[np.float64]:
    """(rows, columns) distance in metres from each cell's centre to the nearest occupied cell's centre."""
    open_cells = plan.cells != OCCUPIED
    if open_cells.all():
        return np.full(plan.cells.shape, np.inf)
    distance: npt.NDArray[np.float64] = ndimage.distance_transform_edt(open_cells) * plan.resolution
    return distance


def _cell(plan: FloorPlan, place: Waypoint) -> tuple[int, int]:
    row, column = plan.cells_of(np.array([[place.x, place.y]]))[0]
    return int(row), int(column)


def _fault_of_place(
    what: str, place: Waypoint, plan: FloorPlan, clearance: npt.NDArray[np.float64], radius: float
) -> str:
    row, column = _cell(plan, place)
    rows, columns = plan.cells.shape
    at = f"{what} at ({place.x:g}, {place.y:g})"
    if not (0 <= row < rows and 0 <= column < columns):
        return f"{at} lies outside the floor plan of {rows} x {columns} cells"
    if plan.cells[row, column] == OCCUPIED:
        return f"{at} lies inside a wall of the floor plan; expected a free cell"
    if clearance[row, column] <= radius:
        return (
            f"{at} is {clearance[row, column]:.2f} m from an obstacle of the floor plan;"
            f" the robot needs more than its radius of {radius:.3f} m"
        )
    return ""


def _check_overlap(plan: FloorPlan, world: World, robot: Robot) -> None:
    """Hold the plan's walls against what of the world stands in the robot's way; the ground may reach farther."""
    occupied = np.argwhere(plan.cells == OCCUPIED)
    if len(occupied) == 0:
        raise FloorPlanError("the floor plan has no occupied cell: expected walls")
    points = plan.points_of(occupied)
    solid, _ = slab_polygons(world.collision, robot.footprint.ground_clearance, robot.footprint.height)
    if len(solid) == 0:
        raise FloorPlanError(f"world {world.name}: nothing solid stands on the floor; expected the plan's walls")
    low, high = solid.min(axis=0), solid.max(axis=0)
    inside = ((points >= low - 0.5) & (points <= high + 0.5)).all(axis=1).mean()
    if inside < 0.5:
        raise FloorPlanError(
            f"the floor plan and the world do not overlap: {inside:.0%} of the plan's walls lie inside the"
            f" world's, x {low[0]:.1f} to {high[0]:.1f} m and y {low[1]:.1f} to {high[1]:.1f} m; expected at least half"
        )
