"""Setting the stage: a scenario becomes a loaded world, a floor plan that fits it, and a robot."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from taskslam.benchmark.spec import Drive, RunSpec, spec_of_tour
from taskslam.errors import FloorPlanError, InputError, ScenarioError, WorldError
from taskslam.mode import Mode
from taskslam.navigation.planners import build_planner
from taskslam.observer import Observer
from taskslam.robot import Robot, load_robot
from taskslam.scenario import Scenario, WorldSource, check_scenario
from taskslam.slam.guest.latency import LatencyModel
from taskslam.world import FloorPlan, World
from taskslam.world.digest import plan_digest, world_digest
from taskslam.world.extrusion import extruded_world
from taskslam.world.loading import load_world
from taskslam.world.map_server import load_floor_plan
from taskslam.world.slicing import slice_floor_plan
from taskslam.world.surface_under import surface_under

WORLD_PATH_VARIABLE = "TASKSLAM_WORLD_PATH"


@dataclass(frozen=True)
class Stage:
    """What every run of a scenario shares. world: None where the platform brings its own."""

    scenario: Scenario
    world: World | None
    plan: FloorPlan
    robot: Robot

    @cached_property
    def digests(self) -> tuple[str, str]:
        """Of the world, empty where the platform brings its own, and of the floor plan."""
        return "" if self.world is None else world_digest(self.world), plan_digest(self.plan)

    def spec(
        self,
        method: str,
        mode: Mode,
        seed: int = 0,
        options: Mapping[str, Any] | None = None,
        latency: LatencyModel | None = None,
        sealed: bool = False,
    ) -> RunSpec:
        """The spec of a run on this stage. Raises InputError for an option that JSON cannot hold."""
        return spec_of_tour(self.scenario, self.robot, self.digests, method, mode, seed, options, latency, sealed)


def stage_of(spec: RunSpec, folders: Sequence[Path], observer: Observer) -> Stage:
    """The stage that a spec tells of, its files found in these folders.

    Raises:
        InputError: it is not the spec of a tour, or what lies in the folders has another content.
        WorldError, FloorPlanError, PlannerError, ScenarioError: as for `set_stage`.
    """
    if not isinstance(spec.task, Drive):
        raise InputError(f"{spec.title}: a replay of a recording has no stage; expected the spec of a tour")
    scenario, robot = spec.task.scenario, spec.task.robot
    if scenario.floor_plan.map is not None:
        map_file = find_file(scenario.floor_plan.map, folders)
        if map_file is None:
            raise FloorPlanError(f"{spec.title}: the map '{scenario.floor_plan.map}' lies in none of the folders")
        plan = scenario.floor_plan.model_copy(update={"map": str(map_file)})
        scenario = scenario.model_copy(update={"floor_plan": plan})
    stage = _prepared(scenario, robot, folders, observer)
    expected = (spec.task.world, spec.task.floor_plan)
    for what, found, wanted in zip(("world", "floor plan"), stage.digests, expected, strict=True):
        if found != wanted:
            raise InputError(
                f"{spec.title}: the {what} found here is not the one of the run: content {found[:12]}, expected"
                f" {wanted[:12]}"
            )
    return stage


def set_stage(scenario: Scenario, world_paths: Sequence[Path], observer: Observer) -> Stage:
    """Load and check everything before anything moves.

    Raises:
        WorldError, FloorPlanError, RobotError, PlannerError, ScenarioError: with one sentence.
    """
    return _prepared(scenario, load_robot(scenario.robot), world_paths, observer)


def _prepared(scenario: Scenario, robot: Robot, world_paths: Sequence[Path], observer: Observer) -> Stage:
    build_planner(scenario.planner, robot)
    world, plan = load_place(scenario, world_paths, observer)
    check_scenario(scenario, plan, world, robot)
    return Stage(scenario, world, plan, robot)


def load_place(scenario: Scenario, world_paths: Sequence[Path], observer: Observer) -> tuple[World | None, FloorPlan]:
    """The world of a scenario, if it names one, and its floor plan; the tour is not looked at.

    Raises WorldError, FloorPlanError, ScenarioError.
    """
    world, plan = None, None
    if scenario.world is not None:
        observer.stage("loading the world")
        plan = _plan(scenario, None) if scenario.world.walls is not None else None
        world = load_scenario_world(scenario, world_paths, plan)
    observer.stage("preparing the floor plan")
    return world, _plan(scenario, world) if plan is None else plan


def load_scenario_world(scenario: Scenario, world_paths: Sequence[Path], plan: FloorPlan | None = None) -> World:
    """The world of a scenario, its floor at z = 0. plan: on which walls are raised, if it was read already.

    Raises WorldError; ScenarioError if it names none.
    """
    source = source_of(scenario)
    if source.walls is not None:
        world = extruded_world(plan or _plan(scenario, None), source.walls, scenario.name)
    elif source.name is not None:
        world = load_world(source.name)
    else:
        file = find_world(scenario, world_paths)
        world = load_world(file, [file.parent / path for path in source.resource_paths])
    return world.without(source.exclude).lowered(source.floor_height)


def source_of(scenario: Scenario) -> WorldSource:
    """Where a scenario's world comes from. Raises ScenarioError if it names none."""
    if scenario.world is None:
        raise ScenarioError(
            f"scenario {scenario.name}: it names no world, and the simulator needs one; expected `world:"
            " {name: ...}`, `world: {file: ...}`, or `world: {walls: 2.2}` to raise walls on its map"
        )
    return scenario.world


def find_world(scenario: Scenario, world_paths: Sequence[Path]) -> Path:
    """The user's copy of a scenario's Gazebo world.

    Raises:
        WorldError: not found under the given folders nor TASKSLAM_WORLD_PATH; says which repository to clone.
    """
    source = source_of(scenario)
    name = source.file or ""
    if (found := find_file(name, world_paths)) is not None:
        return found
    roots = _roots(world_paths)
    looked = ", ".join(str(root) for root in roots) or "nowhere: no folder was given"
    clone = f" Get it with `git clone {source.source}`," if source.source else ""
    raise WorldError(
        f"scenario {scenario.name}: the world file '{name}' was not found (looked in {looked}).{clone} then name the"
        f" folder with --world-path or {WORLD_PATH_VARIABLE}"
    )


def find_file(name: str, folders: Sequence[Path]) -> Path | None:
    """A world or map file by its name, under the given folders or TASKSLAM_WORLD_PATH."""
    roots = _roots(folders)
    for root in [Path("/"), *roots] if Path(name).is_absolute() else roots:
        for candidate in _candidates(root.expanduser(), name):
            if candidate.is_file():
                return candidate
    return None


def folders_of(scenario: Scenario) -> tuple[Path, ...]:
    """The folders in which files lie that a scenario names by their whole paths."""
    world = scenario.world.file if scenario.world is not None else None
    named = [Path(name) for name in (world, scenario.floor_plan.map) if name is not None]
    return tuple(path.parent for path in named if path.is_absolute())


def _roots(folders: Sequence[Path]) -> list[Path]:
    return [*folders, *(Path(p) for p in os.environ.get(WORLD_PATH_VARIABLE, "").split(os.pathsep) if p)]


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


def _plan(scenario: Scenario, world: World | None) -> FloorPlan:
    source = scenario.floor_plan
    if source.map is not None or world is None:
        return load_floor_plan(Path(source.map or ""), free_205=source.free_205)
    seed = (scenario.start.x, scenario.start.y)
    reach = [seed, *((goal.x, goal.y) for goal in scenario.sequence.goals)]
    heights = source.slice_low, source.slice_high
    try:
        plan = slice_floor_plan(world, *heights, source.resolution, seed_point=seed, reach=reach)
    except FloorPlanError as error:
        found = surface_under(world, *seed, below=source.slice_high)
        if found is None or found.height <= source.slice_low:
            raise
        floor = found.height + (scenario.world.floor_height if scenario.world else 0.0)
        raise FloorPlanError(
            f"{error}: a surface of '{found.model}' lies at z = {floor:.3g} m there; if that is the floor, say"
            f" `world: {{floor_height: {floor:.3g}}}`"
        ) from error
    if not (plan.cells == 0).any():
        raise ScenarioError(
            f"scenario {scenario.name}: no free floor around the start ({seed[0]:g}, {seed[1]:g}) between"
            f" {source.slice_low} and {source.slice_high} m: expected the start to stand in the open"
        )
    return plan
