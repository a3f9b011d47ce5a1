"""`taskslam place`: a scenario from what people have of a place: a map, a drawing, or a Gazebo world."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from taskslam.cli.console import say
from taskslam.cli.scenarios import say_tour

if TYPE_CHECKING:
    from taskslam.task import Waypoint

_Answer = TypeVar("_Answer", int, float, str)

app = typer.Typer(help="Places of your own.", no_args_is_help=True)


@app.command()
def new(
    source: Annotated[Path, typer.Argument(help="A map_server yaml, a picture of a floor plan, or a Gazebo world.")],
    out: Annotated[Path | None, typer.Option(help="Scenario to write; default: SOURCE-tour.yaml, here.")] = None,
    goals: Annotated[int | None, typer.Option(min=1, max=200, help="How many goals to propose.")] = None,
    start: Annotated[str, typer.Option(metavar="X,Y,YAW", help="In m and rad; on a map: the most open place.")] = "",
    scale: Annotated[float | None, typer.Option(help="Of a picture: m per pixel.")] = None,
    width: Annotated[float | None, typer.Option(help="Of a picture: m from its left to its right edge.")] = None,
    walls: Annotated[
        float, typer.Option(min=0.2, max=100.0, help="Height of the walls that are raised on a map, m.")
    ] = 2.2,
    free_205: Annotated[bool, typer.Option("--free-205", help="The map draws free space in grey 205.")] = False,
    clearance: Annotated[float, typer.Option(min=0.0, max=100.0, help="Of a goal from every obstacle, m.")] = 0.5,
    robot: Annotated[str, typer.Option(help="A preset or a robot file.")] = "turtlebot2",
) -> None:
    """Make a scenario of a place: walls are raised on a map or a drawing, and goals are proposed.

    What is needed and not given is asked for, if there is a terminal to ask on.

    Examples:
        taskslam place new my_map.yaml --goals 8 --out office.yaml

        taskslam place new plan.png --width 24.5 --goals 12 --out office.yaml

        taskslam place new my.world --start 0,0,0 --goals 10 --out hall.yaml
    """
    from taskslam.benchmark.new_place import Wishes, is_picture, is_world, new_place
    from taskslam.cli.progress import progress
    from taskslam.errors import InputError
    from taskslam.robot import load_robot
    from taskslam.scenario.writing import save_scenario

    target = out or Path(f"{source.stem}-tour.yaml")
    if target.exists():
        raise InputError(f"{target}: exists already; expected the name of a new scenario (--out)")
    if not source.exists():
        raise InputError(f"{source}: there is no such file; expected a map, a picture or a world")
    if goals is None:
        goals = _asked("How many goals?", 12)
    if is_picture(source) and scale is None and width is None and sys.stdin.isatty():
        width = _asked("How wide is the picture, in m?", 20.0)
    if is_world(source) and not start and sys.stdin.isatty():
        start = _asked("Where does the robot start, as x,y,yaw?", "0,0,0")
    wishes = Wishes(goals, _waypoint(start), scale, width, walls, free_205, clearance, robot)
    with progress(quiet=False) as observer:
        scenario, plan = new_place(source, target, wishes, observer)
    save_scenario(scenario, target)
    say_tour(scenario, plan, load_robot(robot))
    say(f"{target}: look at it with `taskslam scenarios preview {target}`")


def _asked(question: str, default: _Answer) -> _Answer:
    if not sys.stdin.isatty():
        return default
    answer: _Answer = typer.prompt(question, default=default, type=type(default))
    return answer


def _waypoint(text: str) -> Waypoint | None:
    from taskslam.cli.worlds import parse_pose
    from taskslam.task import Waypoint

    if not text:
        return None
    pose = parse_pose(text, "--start")
    return Waypoint(x=pose.x, y=pose.y, theta=pose.theta)
