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
    clearance = clearance_map(plan)
    places = [("the start", scenario.start)]
    places += [(f"goal {index}", goal) for index, goal in enumerate(scenario.sequence.goals)]
    radius = robot.footprint.radius
    for what, place in places:
        _check_place(what, place, plan, clearance, radius)
    regions, _ = ndimage.label(clearance > radius, structure=np.ones((3, 3)))
    home = _cell(plan, scenario.start)
    for what, place in places[1:]:
        if regions[_cell(plan, place)] != regions[home]:
            raise ScenarioError(
                f"{what} at ({place.x:g}, {place.y:g}) cannot be reached from the start at ({scenario.start.x:g},"
                f" {scenario.start.y:g}): no way for a robot of {2 * radius:.2f} m diameter on the floor plan"
            )


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


def _check_place(
    what: str, place: Waypoint, plan: FloorPlan, clearance: npt.NDArray[np.float64], radius: float
) -> None:
    row, column = _cell(plan, place)
    rows, columns = plan.cells.shape
    at = f"{what} at ({place.x:g}, {place.y:g})"
    if not (0 <= row < rows and 0 <= column < columns):
        raise ScenarioError(f"{at} lies outside the floor plan of {rows} x {columns} cells")
    if plan.cells[row, column] == OCCUPIED:
        raise ScenarioError(f"{at} lies inside a wall of the floor plan; expected a free cell")
    if clearance[row, column] <= radius:
        raise ScenarioError(
            f"{at} is {clearance[row, column]:.2f} m from an obstacle of the floor plan;"
            f" the robot needs more than its radius of {radius:.3f} m"
        )


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
