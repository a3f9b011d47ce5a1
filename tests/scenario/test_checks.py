from __future__ import annotations

import numpy as np
import pytest

from taskslam.errors import FloorPlanError, ScenarioError
from taskslam.geometry import SE2
from taskslam.robot import load_robot
from taskslam.scenario import Scenario, check_scenario
from taskslam.world import FloorPlan, World
from taskslam.world.floor_plan import FREE, OCCUPIED

HERE = SE2(-4.2, -3.2, 0.0)


def plan_of_room(origin: SE2 = HERE) -> FloorPlan:
    """8.4 m by 6.4 m with walls, parted at x = 2.5 by a wall without a door."""
    cells = np.full((64, 84), FREE, np.uint8)
    cells[:2] = cells[-2:] = OCCUPIED
    cells[:, :2] = cells[:, -2:] = OCCUPIED
    cells[:, 67] = OCCUPIED
    return FloorPlan(cells, 0.1, origin)


def scenario(goal: tuple[float, float]) -> Scenario:
    return Scenario.model_validate(
        {
            "name": "room",
            "world": {"name": "house"},
            "start": {"x": 0, "y": 0, "theta": 0},
            "sequence": {"waypoints": [[goal[0], goal[1], 0.0]]},
        }
    )


@pytest.mark.parametrize(
    ("goal", "complaint"),
    [
        ((-4.1, 0.0), r"goal 1 at \(-4.1, 0\) lies inside a wall"),
        ((-3.98, 0.0), "needs more than its radius"),
        ((3.2, 0.0), "cannot be reached from the start"),
        ((9.0, 0.0), "lies outside the floor plan"),
    ],
)
def test_a_goal_that_cannot_work_is_refused(goal: tuple[float, float], complaint: str, room: World) -> None:
    with pytest.raises(ScenarioError, match=complaint):
        check_scenario(scenario(goal), plan_of_room(), room, load_robot("turtlebot2"))


def test_a_goal_in_the_open_is_fine(room: World) -> None:
    check_scenario(scenario((-2.0, 1.0)), plan_of_room(), room, load_robot("turtlebot2"))


def test_a_plan_of_another_place_is_refused(room: World) -> None:
    with pytest.raises(FloorPlanError, match="do not overlap"):
        check_scenario(scenario((51.0, 51.0)), plan_of_room(SE2(50.0, 50.0, 0.0)), room, load_robot("turtlebot2"))
