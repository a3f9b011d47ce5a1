"""Tours to test with: through the small room, in the loop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from taskslam.benchmark.stage import Stage
from taskslam.robot import load_robot
from taskslam.scenario import Scenario
from taskslam.world import World
from taskslam.world.slicing import slice_floor_plan

GOALS = [[2.5, -1.0, 0.0], [2.8, 1.8, 2.0], [-2.0, 1.0, 3.1]]


@pytest.fixture
def make_stage(room: World) -> Callable[..., Stage]:
    """The stage of a tour through the room; keyword arguments override the protocol."""

    def make(goals: list[list[float]] = GOALS, **protocol: Any) -> Stage:
        scenario = Scenario.model_validate(
            {
                "name": "room",
                "world": {"name": "house"},
                "start": {"x": -2.0, "y": -1.0, "theta": 0.0},
                "sequence": {"waypoints": goals},
                "protocol": {"rounds": 2, "pause": 0.5, "still_start": 0.5, **protocol},
            }
        )
        plan = slice_floor_plan(room, 0.02, 0.45, 0.05, seed_point=(-2.0, -1.0))
        return Stage(scenario, room, plan, load_robot("turtlebot2"))

    return make
