"""`taskslam lab`: photograph a finished simulated run, as cameras in a real building would."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from taskslam.cli.console import say
from taskslam.cli.options import WorldPath


def lab(
    run_dir: Annotated[Path, typer.Argument(metavar="RUN_DIR", help="A finished run in simulation.")],
    lab_file: Annotated[
        str, typer.Argument(metavar="LAB", help="A shipped lab (tsrb_short_cameras, ...) or a YAML file.")
    ],
    out: Annotated[Path, typer.Option(help="New folder for pictures, logs, calibrations and setup files.")],
    world_path: WorldPath = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Photograph a simulated run in the virtual lab: cameras overhead, or tags on the ceiling.

    Writes what a real tour leaves behind: pictures, logs of arrivals, calibrations, and a setup file for
    `taskslam measure`. The truth stands in `truth/`, which nothing that measures reads.

    Examples:
        taskslam lab results/house/karto/without-map/seed0 house_cameras --out lab

        taskslam measure outside-in lab/outside_in.yaml
    """
    from taskslam.benchmark.stage import load_scenario_world
    from taskslam.cli.progress import progress
    from taskslam.lab.lab_file import load_lab
    from taskslam.lab.virtual_lab import photograph, scenario_of
    from taskslam.record import load_run
    from taskslam.robot import load_robot

    wanted = load_lab(lab_file)
    record = load_run(run_dir)
    scenario = scenario_of(record)
    with progress(quiet) as observer:
        observer.run_begins(f"lab {wanted.name}")
        observer.stage("loading the world")
        world = load_scenario_world(scenario, world_path or [])
        setups = photograph(record, world, load_robot(scenario.robot), wanted, out, observer)
    for setup in setups:
        verb = setup.stem.replace("_", "-")
        say(f"Measure with: taskslam measure {verb} {setup}")
