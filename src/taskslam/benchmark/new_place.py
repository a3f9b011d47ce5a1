"""A scenario from what people have of a place: a map_server yaml, a picture with a scale, or a Gazebo world."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from taskslam.benchmark.proposal import CLEARANCE, propose_goals, propose_start
from taskslam.benchmark.stage import load_place
from taskslam.errors import InputError
from taskslam.files import writing
from taskslam.observer import Observer
from taskslam.robot import load_robot
from taskslam.scenario import Scenario
from taskslam.scenario.scenario import FloorPlanSource, WorldSource
from taskslam.task import Sequence, Waypoint
from taskslam.world import FloorPlan
from taskslam.world.loading import WORLD_SUFFIXES
from taskslam.world.map_server import plan_of_picture, save_floor_plan

MAP_SUFFIXES = (".yaml", ".yml")
WALLS = 2.2  # m
_ORIGIN = Waypoint(x=0.0, y=0.0, theta=0.0)


@dataclass(frozen=True)
class Wishes:
    """What a person says of the place.

    goals: how many; start: None for the most open place of a map; scale: m per pixel, or width: m from the left to the
    right edge, of a picture; walls: m, height of those that are raised on a map; clearance: m, of a goal.
    """

    goals: int
    start: Waypoint | None = None
    scale: float | None = None
    width: float | None = None
    walls: float = WALLS
    free_205: bool = False
    clearance: float = CLEARANCE
    robot: str = "turtlebot2"


def is_picture(source: Path) -> bool:
    """Whether a place is given by a picture, which needs a scale."""
    return source.suffix.lower() not in (*MAP_SUFFIXES, *WORLD_SUFFIXES)


def is_world(source: Path) -> bool:
    """Whether a place is given by a Gazebo world, in which a start must be named."""
    return source.suffix.lower() in WORLD_SUFFIXES


def new_place(source: Path, target: Path, wishes: Wishes, observer: Observer) -> tuple[Scenario, FloorPlan]:
    """A scenario that is to be written to `target`, and its floor plan; a picture's map is written beside `target`.

    Raises:
        InputError: a picture without a scale or with two, a scale for what is no picture, a world without a start.
        WorldError, FloorPlanError, ScenarioError: the place cannot be read, or so many goals do not fit.
    """
    _check(source, wishes)
    robot = load_robot(wishes.robot)
    world, plan_source = _sources(source, target, wishes)
    begin = wishes.start or _ORIGIN
    scenario = Scenario(
        name=target.stem, world=world, floor_plan=plan_source, robot=wishes.robot, start=begin,
        sequence=Sequence(waypoints=(begin,)),
    )  # fmt: skip
    _, plan = load_place(scenario, [], observer)
    observer.stage("proposing goals")
    start = wishes.start or propose_start(plan, robot)
    sequence = Sequence(waypoints=propose_goals(plan, robot, start, wishes.goals, wishes.clearance))
    return scenario.model_copy(update={"start": start, "sequence": sequence}), plan


def _check(source: Path, wishes: Wishes) -> None:
    sizes = [size for size in (wishes.scale, wishes.width) if size is not None]
    if not is_picture(source) and sizes:
        raise InputError(f"{source}: a scale is for a picture; a map and a world have theirs")
    if is_picture(source) and len(sizes) != 1:
        many = "two scales, --scale and --width" if sizes else "no scale"
        raise InputError(f"{source}: a picture with {many}; expected one: --scale M_PER_PIXEL or --width METRES")
    if any(not math.isfinite(size) or size <= 0 for size in sizes):
        raise InputError(f"{source}: a scale of {sizes[0]:g}; expected more than 0")
    if is_world(source) and wishes.start is None:
        raise InputError(f"{source}: where in a world is free is not known before; expected --start X,Y,YAW")


def _sources(source: Path, target: Path, wishes: Wishes) -> tuple[WorldSource, FloorPlanSource]:
    if is_world(source):
        return WorldSource(file=str(source.absolute())), FloorPlanSource()
    file = source.absolute()
    if is_picture(source):
        file = target.absolute().with_name(f"{target.stem}-map.yaml")
        if file.exists():
            raise InputError(f"{file}: exists already; expected another --out")
        with writing(file):
            file.parent.mkdir(parents=True, exist_ok=True)
        save_floor_plan(plan_of_picture(source, wishes.scale, wishes.width or 0.0), file, "png")
    return WorldSource(walls=wishes.walls), FloorPlanSource(map=str(file), free_205=wishes.free_205)
