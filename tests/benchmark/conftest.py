"""A tour of the small room: three goals, a short pause, everything in memory except the run directory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from taskslam.benchmark.stage import Stage
from taskslam.geometry import SE2
from taskslam.robot import load_robot
from taskslam.scenario import Scenario
from taskslam.world import FloorPlan, World
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


@pytest.fixture
def empty_plan() -> FloorPlan:
    """A plan of the room without its pillar and walls."""
    return FloorPlan(np.zeros((128, 168), np.uint8), 0.05, SE2(-4.2, -3.2, 0.0))
