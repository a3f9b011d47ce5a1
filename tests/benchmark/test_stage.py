"""Setting the stage, also for a platform that brings a world of its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from taskslam.benchmark.run import run
from taskslam.benchmark.stage import set_stage, stage_of
from taskslam.errors import InputError, ScenarioError
from taskslam.geometry import SE2
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.scenario import Scenario, load_scenario
from taskslam.world import World
from taskslam.world.map_server import save_floor_plan
from taskslam.world.slicing import slice_floor_plan

TOUR = """
name: hall
floor_plan: {map: plan.yaml}
start: {x: -2.0, y: -1.0, theta: 0.0}
sequence: {waypoints: [[-1.0, -1.0, 0.0], [%s, -1.0, 0.0]]}
"""


@pytest.fixture
def hall(room: World, tmp_path: Path) -> Path:
    """A tour of a hall of which only the map is known."""
    save_floor_plan(slice_floor_plan(room, 0.02, 0.45, 0.05, seed_point=(-2.0, -1.0)), tmp_path / "plan.yaml", "png")
    tour = tmp_path / "hall.yaml"
    tour.write_text(TOUR % "0.5")
    return tour


def test_a_robot_that_brings_its_own_world_needs_only_a_map(hall: Path, tmp_path: Path) -> None:
    stage = set_stage(load_scenario(hall), [], Observer())
    assert stage.world is None
    assert stage.plan.at(-2.0, -1.0) == 0
    spec = stage.spec("karto", Mode.WITHOUT_MAP)
    assert spec.task.world == ""
    found = stage_of(spec, [tmp_path], Observer())
    assert found.digests == stage.digests
    assert found.scenario.start.pose == SE2(-2.0, -1.0, 0.0)


def test_its_goals_are_still_held_against_the_map(hall: Path) -> None:
    hall.write_text(TOUR % "4.1")
    with pytest.raises(ScenarioError, match="goal 1 at"):
        set_stage(load_scenario(hall), [], Observer())


def test_the_simulator_says_that_it_needs_a_world(hall: Path, tmp_path: Path) -> None:
    stage = set_stage(load_scenario(hall), [], Observer())
    with pytest.raises(ScenarioError, match="scenario hall: it names no world, and the simulator needs one"):
        run(stage, stage.spec("ground_truth", Mode.WITHOUT_MAP), tmp_path / "out")


def test_a_map_that_is_not_the_one_of_the_run_is_refused(hall: Path, room: World, tmp_path: Path) -> None:
    spec = set_stage(load_scenario(hall), [], Observer()).spec("karto", Mode.WITHOUT_MAP)
    coarse = slice_floor_plan(room, 0.02, 0.45, 0.1, seed_point=(-2.0, -1.0))
    save_floor_plan(coarse, tmp_path / "plan.yaml", "png")
    with pytest.raises(InputError, match="the floor plan found here is not the one of the run"):
        stage_of(spec, [tmp_path], Observer())


def test_neither_world_nor_map_is_refused() -> None:
    bare = {"name": "bare", "start": {"x": 0, "y": 0, "theta": 0}, "sequence": {"waypoints": [[1, 0, 0]]}}
    with pytest.raises(ValueError, match=r"give `world`, or `floor_plan\.map`"):
        Scenario.model_validate(bare)
