"""`taskslam report`: one self-contained page about the runs in some folders."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from taskslam.cli.console import say


def report(
    directories: Annotated[list[Path], typer.Argument(help="Run directories, or folders that hold some at any depth.")],
    out: Annotated[Path, typer.Option(help="Where the page is written.")] = Path("report.html"),
) -> None:
    """Write one HTML page about finished runs, with all its pictures in it; it opens without a network.

    Verdicts first, then figures and tables with filters and a switch of units, the rounds behind every waypoint, and
    what led to each failure. What could not be read is named on the page.

    Examples:
        taskslam report results

        taskslam report results/house/karto results/house/wheel_odometry --out comparison.html
    """
    from taskslam.cli.progress import progress
    from taskslam.report import write_report

    with progress(quiet=False) as observer:
        observer.stage("reading runs and drawing the page")
        page = write_report(directories, out)
    say(f"Report: {page}")
