"""`taskslam scenarios`: the tours there are, how they look before they are driven, and goals for a place."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import say, standard_output
from taskslam.cli.options import WorldPath
from taskslam.cli.served_page import serve_page

if TYPE_CHECKING:
    from taskslam.benchmark.survey import Leg, Survey
    from taskslam.robot import Robot
    from taskslam.scenario import Scenario
    from taskslam.world import FloorPlan

app = typer.Typer(help="Tours: a place, a robot, a start and goals.", no_args_is_help=True)

_Reference = Annotated[str, typer.Argument(metavar="NAME|FILE", help="A name from `list`, or a YAML file.")]
_Set = Annotated[
    list[str] | None, typer.Option("--set", help="Override a scenario key: robot=my.yaml; may be repeated.")
]


@app.command("list")
def list_scenarios() -> None:
    """List the scenarios that ship.

    Example: `taskslam scenarios list`
    """
    from rich.table import Table

    from taskslam.scenario import load_scenario, shipped_scenarios

    table = Table(box=None, pad_edge=False)
    for column in ("name", "goals", "what"):
        table.add_column(column)
    for name in shipped_scenarios():
        scenario = load_scenario(name)
        source = scenario.world.source if scenario.world is not None else ""
        where = f"; its world: {source}" if source else ""
        table.add_row(name, str(len(scenario.sequence.goals)), f"{scenario.title or ''}{where}")
    standard_output().print(table)


@app.command()
def show(reference: _Reference, world_path: WorldPath = None, set_: _Set = None) -> None:
    """Show a tour: every goal, the way to it, how clear of obstacles it is, and what is wrong.

    Exit status 1 if something is.

    Example: `taskslam scenarios show house`
    """
    scenario, _, _, looked = _surveyed(reference, world_path, set_)
    _print_survey(scenario, looked)
    raise typer.Exit(1 if looked.faults else 0)


@app.command()
def preview(
    reference: _Reference,
    out: Annotated[Path, typer.Option(help="The page.")] = Path("preview.html"),
    world_path: WorldPath = None,
    set_: _Set = None,
) -> None:
    """Draw a tour before it is driven: floor plan, goals with their headings, planned ways, clearances, what is wrong.

    Exit status 1 if something is.

    Example: `taskslam scenarios preview house --out preview.html`
    """
    from taskslam.report.page.preview import write_preview

    scenario, plan, robot, looked = _surveyed(reference, world_path, set_)
    write_preview(scenario, plan, robot, looked, out)
    for fault in looked.faults:
        say(fault)
    say(str(out))
    raise typer.Exit(1 if looked.faults else 0)


@app.command()
def edit(
    reference: _Reference,
    out: Annotated[Path | None, typer.Option(help="File to save into; default: FILE itself.")] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Of the page; 0 for any that is free.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in your browser.")] = True,
    world_path: WorldPath = None,
    set_: _Set = None,
) -> None:
    """Edit a tour on its floor plan in the browser: click, drag, turn, save. The page is served to this machine alone.

    Example: `taskslam scenarios edit house --out my_tour.yaml`
    """
    from taskslam.errors import InputError
    from taskslam.report.page.editor import Editor

    target = out or Path(reference)
    if target.suffix not in (".yaml", ".yml"):
        raise InputError(f"'{target}' is no file to save into; expected --out FILE.yaml")
    scenario, plan, robot = _loaded(reference, world_path, set_)
    serve_page(Editor(scenario, plan, robot, target), port, browser, f"; what is saved is in {target}")


@app.command()
def propose(
    reference: _Reference,
    goals: Annotated[int, typer.Option(min=1, max=200, help="How many.")] = 12,
    clearance: Annotated[float, typer.Option(min=0.0, max=100.0, help="From every obstacle, m.")] = 0.5,
    out: Annotated[Path | None, typer.Option(help="File to write; without it, the YAML is printed.")] = None,
    world_path: WorldPath = None,
    set_: _Set = None,
) -> None:
    """Propose goals for the place of a scenario: reachable, far from one another, clear of obstacles, in a short tour.

    Example: `taskslam scenarios propose house --goals 8 --out my_tour.yaml`
    """
    from taskslam.benchmark.proposal import propose_goals
    from taskslam.scenario.writing import save_scenario, scenario_text
    from taskslam.task import Sequence

    scenario, plan, robot = _loaded(reference, world_path, set_)
    proposed = propose_goals(plan, robot, scenario.start, goals, clearance)
    toured = scenario.model_copy(update={"sequence": Sequence(waypoints=proposed)})
    if out is None:
        say(scenario_text(toured, Path.cwd()).rstrip())
        return
    save_scenario(toured, out)
    say_tour(toured, plan, robot)
    say(str(out))


def say_tour(scenario: Scenario, plan: FloorPlan, robot: Robot) -> None:
    """Say how many goals, how far and how clear."""
    from taskslam.benchmark.survey import survey

    looked = survey(scenario, plan, robot)
    clear = f"each {100 * looked.clearance_m:.0f} cm or more clear"
    say(f"{len(looked.legs)} goals, {looked.length_m:.1f} m of way a round, {clear}")


def _loaded(reference: str, world_path: list[Path] | None, set_: list[str] | None) -> tuple[Scenario, FloorPlan, Robot]:
    from taskslam.benchmark.stage import load_place
    from taskslam.cli.progress import progress
    from taskslam.robot import load_robot
    from taskslam.scenario import load_scenario

    scenario = load_scenario(reference, set_ or [])
    robot = load_robot(scenario.robot)
    with progress(quiet=False) as observer:
        _, plan = load_place(scenario, world_path or [], observer)
    return scenario, plan, robot


def _surveyed(
    reference: str, world_path: list[Path] | None, set_: list[str] | None
) -> tuple[Scenario, FloorPlan, Robot, Survey]:
    from taskslam.benchmark.survey import survey

    scenario, plan, robot = _loaded(reference, world_path, set_)
    return scenario, plan, robot, survey(scenario, plan, robot)


def _print_survey(scenario: Scenario, looked: Survey) -> None:
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for column in ("goal", "x, m", "y, m", "heading", "way, m", "clear, cm", "narrowest, cm"):
        table.add_column(column, justify="right")
    for number, leg in enumerate(looked.legs, start=1):
        table.add_row(*_row(number, leg))
    console = standard_output()
    console.print(
        f"{scenario.title or scenario.name}: {len(looked.legs)} goals, {looked.length_m:.1f} m of way a round"
    )
    console.print(table)
    for fault in looked.faults:
        console.print(fault, style="red", soft_wrap=True)


def _row(number: int, leg: Leg) -> tuple[str, ...]:
    import math

    from taskslam.report.words import whole_centimetres

    length = leg.length_m
    return (
        str(number), f"{leg.goal.x:.2f}", f"{leg.goal.y:.2f}", f"{math.degrees(leg.goal.theta):.0f}°",
        "–" if length is None else f"{length:.1f}",
        whole_centimetres(leg.clearance_m), whole_centimetres(leg.narrowest_m),
    )  # fmt: skip
