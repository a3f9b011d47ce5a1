"""Setting the stage, also for a platform that brings a world of its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from taskslam.benchmark.run import run
from taskslam.benchmark.stage import set_stage, stage_of
from taskslam.errors import FloorPlanError, InputError, ScenarioError, WorldError
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
    with pytest.raises(ScenarioError, match="goal 2 at"):
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


BOX = (
    "<collision name='{0}'><pose>{1} 0 0 0</pose><geometry><box><size>{2}</size></box></geometry></collision>"
    "<visual name='{0}'><pose>{1} 0 0 0</pose><geometry><box><size>{2}</size></box></geometry></visual>"
)


def gazebo_world(folder: Path, **models: str) -> None:
    """A Gazebo world of models, each a few boxes."""
    bodies = "".join(f"<model name='{name}'><link name='l'>{boxes}</link></model>" for name, boxes in models.items())
    (folder / "w.sdf").write_text(f"<sdf version='1.7'><world name='w'>{bodies}</world></sdf>")


def three_walls() -> str:
    """A room of 8 x 6 m that is open at x = -4."""
    return (
        BOX.format("e", "4 0 1", "0.2 6 2") + BOX.format("n", "0 3 1", "8 0.2 2") + BOX.format("s", "0 -3 1", "8 0.2 2")
    )


def gazebo_tour(folder: Path, goal: str = "2, 0, 0", world: str = "") -> Path:
    tour = folder / "tour.yaml"
    tour.write_text(
        f"name: tour\nworld: {{file: {folder}/w.sdf{world}}}\nstart: {{x: 0, y: 0, theta: 0}}\n"
        f"sequence: {{waypoints: [[{goal}]]}}\n"
    )
    return tour


def test_a_goal_outside_the_walls_is_on_the_plan(tmp_path: Path) -> None:
    gazebo_world(tmp_path, walls=three_walls())
    inside = set_stage(load_scenario(gazebo_tour(tmp_path)), [], Observer()).plan
    plan = set_stage(load_scenario(gazebo_tour(tmp_path, "-7, 1, 0")), [], Observer()).plan
    assert inside.at(-7, 1) == 255
    assert plan.at(-7, 1) == 0
    assert plan.at(-7.9, 1) == 0
    assert plan.cells.shape[0] == inside.cells.shape[0]


def test_a_slab_that_the_start_stands_on_is_named_with_the_floor_height(tmp_path: Path) -> None:
    gazebo_world(tmp_path, walls=three_walls(), slab=BOX.format("f", "0 0 0", "20 20 0.1"))
    with pytest.raises(FloorPlanError, match=r"a surface of 'slab' lies at z = 0.05 m there; .*floor_height: 0.05"):
        set_stage(load_scenario(gazebo_tour(tmp_path)), [], Observer())
    stage = set_stage(load_scenario(gazebo_tour(tmp_path, world=", floor_height: 0.05")), [], Observer())
    assert stage.plan.at(0, 0) == 0
    with pytest.raises(FloorPlanError, match=r"lies at z = 0.05 m there"):
        set_stage(load_scenario(gazebo_tour(tmp_path, world=", floor_height: 0.01")), [], Observer())


def test_a_model_at_the_start_can_be_excluded(tmp_path: Path) -> None:
    robot = BOX.format("body", "0 0 0.2", "0.4 0.4 0.4")
    gazebo_world(tmp_path, walls=three_walls(), burger=robot)
    with pytest.raises(FloorPlanError, match=r"seed point .* is occupied"):
        set_stage(load_scenario(gazebo_tour(tmp_path)), [], Observer())
    stage = set_stage(load_scenario(gazebo_tour(tmp_path, world=", exclude: [burger]")), [], Observer())
    assert stage.plan.at(0, 0) == 0
    assert stage.world is not None
    assert (len(stage.world.visual), len(stage.world.collision)) == (36, 36)
    with pytest.raises(WorldError, match=r"has no model 'burgr' to exclude; .* Did you mean 'burger'"):
        set_stage(load_scenario(gazebo_tour(tmp_path, world=", exclude: [burgr]")), [], Observer())
