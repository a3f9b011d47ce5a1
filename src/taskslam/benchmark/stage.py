"""Setting the stage: a scenario becomes a loaded world, a floor plan that fits it, and a robot."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from taskslam.errors import ScenarioError, WorldError
from taskslam.navigation.planners import build_planner
from taskslam.observer import Observer
from taskslam.robot import Robot, load_robot
from taskslam.scenario import Scenario, check_scenario
from taskslam.world import FloorPlan, World
from taskslam.world.loading import load_world
from taskslam.world.map_server import load_floor_plan
from taskslam.world.slicing import slice_floor_plan

WORLD_PATH_VARIABLE = "TASKSLAM_WORLD_PATH"


@dataclass(frozen=True)
class Stage:
    """What every run of a scenario shares."""

    scenario: Scenario
    world: World
    plan: FloorPlan
    robot: Robot


def set_stage(scenario: Scenario, world_paths: Sequence[Path], observer: Observer) -> Stage:
    """Load and check everything before anything moves.

    Raises:
        WorldError, FloorPlanError, RobotError, PlannerError, ScenarioError: with one sentence.
    """
    robot = load_robot(scenario.robot)
    build_planner(scenario.planner, robot)
    observer.stage("loading the world")
    world = load_scenario_world(scenario, world_paths)
    observer.stage("preparing the floor plan")
    plan = _plan(scenario, world)
    check_scenario(scenario, plan, world, robot)
    return Stage(scenario, world, plan, robot)


def load_scenario_world(scenario: Scenario, world_paths: Sequence[Path]) -> World:
    """The world of a scenario, its floor at z = 0. Raises WorldError."""
    source = scenario.world
    if source.name is not None:
        return load_world(source.name).lowered(source.floor_height)
    file = find_world(scenario, world_paths)
    folders = [file.parent / path for path in source.resource_paths]
    return load_world(file, folders).lowered(source.floor_height)


def find_world(scenario: Scenario, world_paths: Sequence[Path]) -> Path:
    """The user's copy of a scenario's Gazebo world.

    Raises:
        WorldError: not found under the given folders nor TASKSLAM_WORLD_PATH; says which repository to clone.
    """
    name = scenario.world.file or ""
    from_environment = [Path(p) for p in os.environ.get(WORLD_PATH_VARIABLE, "").split(os.pathsep) if p]
    roots = [*world_paths, *from_environment]
    for root in [Path("/"), *roots] if Path(name).is_absolute() else roots:
        for candidate in _candidates(root.expanduser(), name):
            if candidate.is_file():
                return candidate
    looked = ", ".join(str(root) for root in roots) or "nowhere: no folder was given"
    clone = f" Get it with `git clone {scenario.world.source}`," if scenario.world.source else ""
    raise WorldError(
        f"scenario {scenario.name}: the world file '{name}' was not found (looked in {looked}).{clone} then name the"
        f" folder with --world-path or {WORLD_PATH_VARIABLE}"
    )


def _candidates(root: Path, name: str) -> Iterator[Path]:
    """The file itself, or as it lies in a clone of its repository, or in a folder of such clones."""
    if root.name == Path(name).name:
        yield root
    yield root / name
    if Path(name).is_absolute():
        return
    yield root / "worlds" / name
    for pattern in (
        f"*/worlds/{name}",
        f"*/{name}",
        f"worlds/*/worlds/{name}",
        f"worlds/*/{name}",
        f"configs/*/{name}",
    ):
        yield from sorted(root.glob(pattern))


def _plan(scenario: Scenario, world: World) -> FloorPlan:
    source = scenario.floor_plan
    if source.map is not None:
        return load_floor_plan(Path(source.map), free_205=source.free_205)
    seed = (scenario.start.x, scenario.start.y)
    plan = slice_floor_plan(world, source.slice_low, source.slice_high, source.resolution, seed_point=seed)
    if not (plan.cells == 0).any():
        raise ScenarioError(
            f"scenario {scenario.name}: no free floor around the start ({seed[0]:g}, {seed[1]:g}) between"
            f" {source.slice_low} and {source.slice_high} m: expected the start to stand in the open"
        )
    return plan
