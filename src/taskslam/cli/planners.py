"""`taskslam planners`: the local planners that can follow the global path."""

from __future__ import annotations

import typer

app = typer.Typer(no_args_is_help=True, help="Local planners: what turns a path into velocity commands.")


@app.callback()
def _planners() -> None:
    pass


@app.command("list")
def list_planners() -> None:
    """List the registered local planners.

    Example: `taskslam planners list`, then `taskslam run house -m karto --set planner=NAME`
    """
    from rich.console import Console
    from rich.table import Table

    from taskslam.navigation.planners import registered_planners

    table = Table(box=None, pad_edge=False)
    table.add_column("name", style="bold")
    table.add_column("made by")
    for name, entry in registered_planners().items():
        table.add_row(name, entry.value)
    Console().print(table)
