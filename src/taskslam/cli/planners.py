"""`taskslam planners`: the local planners that can follow the global path."""

from __future__ import annotations

import typer

from taskslam.cli.console import standard_output
from taskslam.cli.registered import registered_table

app = typer.Typer(no_args_is_help=True, help="Local planners: what turns a path into velocity commands.")


@app.callback()
def _planners() -> None:
    pass


@app.command("list")
def list_planners() -> None:
    """List the registered local planners.

    Example: `taskslam planners list`, then `taskslam run house -m karto --set planner=NAME`
    """
    from taskslam.navigation.planners import registered_planners

    standard_output().print(registered_table(registered_planners()))
