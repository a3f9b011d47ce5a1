"""`taskslam measure`: poses of a real robot at its waypoints, from cameras and AprilTags."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import say, standard_error

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager

    from taskslam.realworld.measure import MeasuredRun, Progress

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Measure where a real robot stood at its waypoints; write runs for evaluate, report and compare.",
)

SetupFile = Annotated[Path, typer.Argument(help="YAML: tags, cameras, logs of arrivals (docs/measure_your_robot.md).")]
Out = Annotated[Path, typer.Option(help="Folder for the run directories.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace a run that is there already.")]
Published = Annotated[
    bool, typer.Option("--published", help="For comparison: x, y in the camera's frame, as the published code has it.")
]


@app.command("outside-in")
def outside_in(
    setup: SetupFile, out: Out = Path("measured"), published: Published = False, overwrite: Overwrite = False
) -> None:
    """Cameras over the waypoints look at the tag on the robot.

    Every arrival in the logs ends as measured, not seen or ambiguous, with the reason and the image.

    Examples:
        taskslam measure outside-in setup.yaml

        taskslam measure outside-in setup.yaml --out published_way --published
    """
    from taskslam.realworld.measure import measure_outside_in
    from taskslam.realworld.setup_file import OutsideInSetup, load_setup

    content = load_setup(setup, OutsideInSetup)
    with _progress() as progress:
        runs = measure_outside_in(content, out, published, overwrite, progress)
    _print(runs)


@app.command("inside-out")
def inside_out(
    setup: SetupFile, out: Out = Path("measured"), published: Published = False, overwrite: Overwrite = False
) -> None:
    """A camera on the robot looks up at tags over the waypoints.

    The pose is that of the robot in the frame of the tags; four tags over a waypoint let it tilt.

    Examples:
        taskslam measure inside-out setup.yaml
    """
    from taskslam.realworld.measure import measure_inside_out
    from taskslam.realworld.setup_file import InsideOutSetup, load_setup

    content = load_setup(setup, InsideOutSetup)
    with _progress() as progress:
        runs = measure_inside_out(content, out, published, overwrite, progress)
    _print(runs)


@app.command("served")
def served(
    run: Annotated[Path, typer.Argument(help="The run directory of a tour on a robot that we served.")],
    by: Annotated[Path, typer.Option(help="The folder of the served robot's record.")] = Path("served"),
    out: Out = Path("measured"),
    overwrite: Overwrite = False,
) -> None:
    """Take the true poses from the record of our served simulator, which was the robot.

    Examples:
        taskslam measure served results/house/karto/without-map/seed0 --by served
    """
    from taskslam.realworld.served_truth import measure_served

    say(str(measure_served(run, by, out, overwrite)))


def _progress() -> AbstractContextManager[Progress]:
    from contextlib import contextmanager

    from rich.progress import Progress as Bars

    @contextmanager
    def bars() -> Iterator[Progress]:
        console = standard_error()
        with Bars(console=console, transient=True, disable=not console.is_terminal) as shown:
            tasks = {}

            def report(camera: str, done: int, total: int) -> None:
                if camera not in tasks:
                    tasks[camera] = shown.add_task(f"images of {camera}", total=total)
                shown.update(tasks[camera], completed=done)

            yield report

    return bars()


def _print(runs: list[MeasuredRun]) -> None:
    from taskslam.realworld.association import Verdict

    said: set[str] = set()
    for run in runs:
        for note in run.notes:
            if note not in said:
                say(f"Note: {note}", err=True)
                said.add(note)
        for found in run.arrivals:
            if found.verdict is not Verdict.MEASURED:
                at = f"waypoint {found.arrival.goal + 1}, round {found.arrival.round + 1}"
                say(f"  {at}: {found.verdict}: {found.reason}", err=True)
        numbers = [str(goal + 1) for goal in run.unjudged]
        left = f"; not judged: waypoint {', '.join(numbers)}" if numbers else ""
        counted = ", ".join(f"{run.counts.get(verdict, 0)} {verdict}" for verdict in Verdict)
        say(f"{run.directory}: {counted}{left}")
