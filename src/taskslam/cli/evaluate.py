"""`taskslam evaluate`: tables on the screen, metrics.json in the folder."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from taskslam.evaluation import MetricsFile, RunMetrics

_FEW_RUNS, _MOST_RUNS = 40, 500  # shown by waypoint; shown at all


def evaluate(
    directory: Annotated[Path, typer.Argument(help="A run directory, or a folder that holds some at any depth.")],
    upstream_compat: Annotated[
        str,
        typer.Option(
            "--upstream-compat",
            metavar="NAMES",
            help="Compute as the published code does where it differs: all, or names of deviations (docs/metrics.md).",
        ),
    ] = "",
    waypoints: Annotated[
        bool | None,
        typer.Option("--waypoints/--no-waypoints", help="Show every waypoint; left out, it is done for up to 40 runs."),
    ] = None,
) -> None:
    """Evaluate finished runs: tables on the screen, metrics.json in DIRECTORY.

    A run that cannot be read is named and left out.

    Examples:
        taskslam evaluate results

        taskslam evaluate results/aws_small_house/karto/with-map/seed0 --upstream-compat
    """
    from rich.console import Console

    from taskslam.evaluation import evaluate_runs, write_metrics
    from taskslam.evaluation.upstream import NONE, parse_deviations

    metrics = evaluate_runs([directory], parse_deviations(upstream_compat) if upstream_compat else NONE)
    path = write_metrics(directory, metrics)
    console = Console(highlight=False)
    if waypoints or (waypoints is None and len(metrics.runs) <= _FEW_RUNS):
        for run in metrics.runs:
            console.print(_waypoint_table(run))
            _print_failures(console, run)
            console.print()
    if len(metrics.runs) > _MOST_RUNS:
        typer.echo(f"{len(metrics.runs):,} runs are too many for a table: they are in metrics.json.")
    elif metrics.runs:
        _print_summary(console, metrics)
    for left in metrics.left_out:
        typer.echo(f"Left out {directory / left.directory}: {left.reason}", err=True)
    typer.echo(f"Metrics: {path}")


def _print_summary(console: Console, metrics: MetricsFile) -> None:
    """Two tables a scenario, each narrow enough for 80 columns: how well it went, and what it took."""
    for scenario in sorted({run.scenario for run in metrics.runs}):
        results = _table(f"{scenario}: results", ("complete", "E cm", "e cm", "Δ °", "δ °", "N-AUC", "exact"))
        effort = _table(f"{scenario}: effort", ("failures", "simulated min", "× real", "dropped frames"))
        for run in metrics.runs:
            if run.scenario != scenario:
                continue
            who = (run.method, "w/" if run.mode == "with-map" else "w/o", str(run.seed))
            results.add_row(
                *who,
                f"{run.complete_waypoints}/{run.planned_waypoints}",
                _centimetres(run.position.precision_m),
                _centimetres(run.position.accuracy_m),
                _degrees(run.orientation.precision_rad),
                _degrees(run.orientation.accuracy_rad),
                _plain(run.n_auc.published, 3),
                _plain(run.n_auc.exact, 3),
            )
            effort.add_row(
                *who,
                str(len(run.failures)),
                f"{run.simulated_s / 60:.1f}",
                _plain(run.real_time_factor, 1),
                f"{run.dropped_frames} of {run.frames}",
            )
        console.print(results)
        console.print(effort)
    upstream = " Formulas of the published code." if metrics.definitions == "upstream" else ""
    console.print(
        "E, Δ: mean distance and angle of arrivals to their mean; e, δ: to the goal."
        f" Means over waypoints reached in every round.{upstream}"
    )


def _table(title: str, columns: tuple[str, ...]) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(
        title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0)
    )
    table.add_column("method", overflow="fold")
    table.add_column("map", no_wrap=True)
    table.add_column("seed", no_wrap=True, justify="right")
    for name in columns:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def _waypoint_table(run: RunMetrics) -> Table:
    from rich import box
    from rich.table import Table

    title = f"{run.scenario} · {run.method} · {run.mode} · seed {run.seed}"
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    names = ("waypoint", "visits", "E cm", "e cm", "Δ °", "δ °", "control cm", "estimation cm")
    for name in names:
        table.add_column(name, justify="right", no_wrap=True)
    for waypoint in run.waypoints:
        table.add_row(
            str(waypoint.goal + 1),
            f"{waypoint.visits}/{waypoint.rounds}",
            _centimetres(waypoint.position.precision_m),
            _centimetres(waypoint.position.accuracy_m),
            _degrees(waypoint.orientation.precision_rad),
            _degrees(waypoint.orientation.accuracy_rad),
            _centimetres(waypoint.control.position_m),
            _centimetres(waypoint.estimation.position_m),
            style=None if waypoint.complete else "dim",
        )
    return table


def _print_failures(console: Console, run: RunMetrics) -> None:
    from rich.text import Text

    for failure in run.failures:
        where = f"{run.round_name(failure.round)}, waypoint {failure.goal + 1}, at {failure.t_s:.0f} s"
        console.print(Text.assemble((f"  {failure.outcome}", "bold red"), f"  {where}: {failure.detail}"))


def _centimetres(value: float | None) -> str:
    return _plain(None if value is None else value * 100, 2)


def _degrees(value: float | None) -> str:
    return _plain(None if value is None else math.degrees(value), 2)


def _plain(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"
