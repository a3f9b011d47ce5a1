"""`taskslam import-trials`: published-style trial directories become run directories."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from taskslam.cli.console import say
from taskslam.mode import Mode


class ImportMode(StrEnum):
    """How the rounds were driven."""

    AUTO = "auto"
    WITHOUT_MAP = Mode.WITHOUT_MAP.value
    WITH_MAP = Mode.WITH_MAP.value


def import_trials(
    folder: Annotated[Path, typer.Argument(help="Results in the published layout: ENVIRONMENT/METHOD/PATH/trial<k>.")],
    out: Annotated[Path, typer.Option(help="Folder for run directories.")] = Path("imported"),
    rounds: Annotated[int, typer.Option(min=1, help="Rounds that count (M), the priming loop not among them.")] = 5,
    mode: Annotated[
        ImportMode, typer.Option(help="Default: told from folder names (slam, localization) or loops.")
    ] = ImportMode.AUTO,
    overwrite: Annotated[bool, typer.Option(help="Replace runs that were imported before.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing.")] = False,
) -> None:
    """Import trials in the published layout, with counts of what was missing; `taskslam evaluate` and `report` follow.

    Exit status: 0 every set of trials was imported; 1 some were left out; 2 there was none.

    Example:
        taskslam import-trials cl_nav_slam/gazebo --out imported
    """
    from taskslam.datasets.trial_import import import_trials as take_in

    result = take_in(folder, out, rounds, None if mode is ImportMode.AUTO else Mode(mode), overwrite)
    for run in [] if quiet else result.runs:
        say(f"{run.name}: {run.arrivals} of {run.planned} arrivals, in {run.directory}")
        for what, count in sorted(run.missing.items()):
            say(f"  {count} {what}")
    for group, reason in result.left_out.items():
        say(f"left out {group}: {reason}", err=True)
    raise typer.Exit(1 if result.left_out else 0)
