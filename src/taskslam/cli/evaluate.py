"""`taskslam evaluate`: tables on the screen, metrics.json in the folder."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import standard_output

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from taskslam.evaluation import MetricsFile, RunMetrics
    from taskslam.evaluation.metrics_file import Interval

_FEW_RUNS, _MOST_RUNS = 40, 500  # shown by waypoint; shown at all
_MOST_PAIRS = 10  # of methods, whose comparison is shown
_WITH_INTERVALS = 100  # columns of the screen


def evaluate(
    directory: Annotated[Path, typer.Argument(help="A run directory, or a folder that holds some at any depth.")],
    upstream_compat: Annotated[
        bool, typer.Option("--upstream-compat", help="Compute as the published code does, wherever it differs.")
    ] = False,
    deviations: Annotated[
        str,
        typer.Option(metavar="NAMES", help="Only these deviations of the published code, by name (docs/metrics.md)."),
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

        taskslam evaluate results --no-waypoints --upstream-compat

        taskslam evaluate results --deviations unnormalised-heading,priming-round
    """
    from taskslam.evaluation import evaluate_runs, write_metrics
    from taskslam.evaluation.names import method_labels
    from taskslam.evaluation.upstream import ALL, NONE, parse_deviations

    chosen = parse_deviations(deviations) if deviations else ALL if upstream_compat else NONE
    metrics = evaluate_runs([directory], chosen)
    path = write_metrics(directory, metrics)
    console = standard_output()
    labels = method_labels(metrics.runs)
    if waypoints or (waypoints is None and len(metrics.runs) <= _FEW_RUNS):
        for label, run in zip(labels, metrics.runs, strict=True):
            console.print(_waypoint_table(label, run))
            _print_failures(console, run)
            console.print()
    if len(metrics.runs) > _MOST_RUNS:
        typer.echo(f"{len(metrics.runs):,} runs are too many for a table: they are in metrics.json.")
    elif metrics.runs:
        _print_summary(console, metrics, labels)
    for said in (sentence for run in metrics.runs for sentence in run.journal_damaged):
        typer.echo(f"Damaged: {said}", err=True)
    for left in metrics.left_out:
        typer.echo(f"Left out {directory / left.directory}: {left.reason}", err=True)
    typer.echo(f"Metrics: {path}")


def _print_summary(console: Console, metrics: MetricsFile, labels: Sequence[str]) -> None:
    """Two tables a scenario: how well it went, and what it took. Where the screen is narrow, without intervals."""
    wide = console.width >= _WITH_INTERVALS
    E, e = ("E cm [95 %]", "e cm [95 %]") if wide else ("E cm", "e cm")
    for scenario in sorted({run.scenario for run in metrics.runs}):
        results = _table(f"{scenario}: results", ("complete", E, e, "Δ °", "δ °", "N-AUC", "exact"))
        effort = _table(f"{scenario}: effort", ("failures", "sim. min", "× real", "dropped frames", "method MB"))
        for label, run in zip(labels, metrics.runs, strict=True):
            if run.scenario != scenario:
                continue
            who = _who(label, run)
            results.add_row(
                *who,
                f"{run.complete_waypoints}/{run.planned_waypoints}",
                _with_interval(run.position.precision_m, run.uncertainty.precision_m if wide else None),
                _with_interval(run.position.accuracy_m, run.uncertainty.accuracy_m if wide else None),
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
                _plain(run.method_peak_bytes and run.method_peak_bytes / 1e6, 0),
            )
        console.print(results)
        console.print(effort)
    console.print(
        "E, Δ: mean distance and angle of arrivals to their mean; e, δ: to the goal."
        " Means over waypoints reached in every round"
        + (
            "; [ ]: 95 % interval over rounds and waypoints."
            if wide
            else f" ({_WITH_INTERVALS} columns show intervals)."
        )
    )
    _print_comparisons(console, metrics)
    if metrics.deviations:
        _print_deviations(console, metrics, labels)


def _print_comparisons(console: Console, metrics: MetricsFile) -> None:
    """The verdicts on precision; of many pairs, how many could be told apart."""
    for mode, words in (("without-map", "without map"), ("with-map", "with map")):
        found = [c for c in metrics.comparisons if c.mode == mode and c.metric == "precision"]
        if len(found) > _MOST_PAIRS:
            apart = sum(comparison.told_apart for comparison in found)
            console.print(f"\nPrecision {words}: {apart} of {len(found)} pairs told apart; they are in metrics.json.")
        elif found:
            console.print(f"\nPrecision {words}:")
            for comparison in found:
                console.print(f"  {comparison.verdict}", markup=False)


def _print_deviations(console: Console, metrics: MetricsFile, labels: Sequence[str]) -> None:
    """What the published code makes of each run, what the definitions give, and the difference."""
    names = ("as published", "by definition", "difference")
    table = _table(f"Deviations of the published code: {', '.join(metrics.deviations)}", ("quantity", *names))
    for label, run in zip(labels, metrics.runs, strict=True):
        if run.by_definition is None:
            continue
        for what, field, show in _QUANTITIES:
            published, right = getattr(run.headline, field), getattr(run.by_definition, field)
            if published != right and not math.isclose(published or 0.0, right or 0.0, rel_tol=1e-4):
                difference = None if published is None or right is None else published - right
                table.add_row(*_who(label, run), what, show(published), show(right), show(difference))
    if table.row_count:
        console.print(table)
    else:
        console.print("\nThe published code gives the same numbers for these runs.")


def _table(title: str, columns: tuple[str, ...]) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(
        title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0)
    )
    table.add_column("method", overflow="fold", min_width=12)
    table.add_column("map", no_wrap=True)
    table.add_column("seed", no_wrap=True, justify="right")
    for name in columns:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def _who(label: str, run: RunMetrics) -> tuple[str, str, str]:
    return (label, "w/" if run.mode == "with-map" else "w/o", str(run.seed))


def _waypoint_table(label: str, run: RunMetrics) -> Table:
    from rich import box
    from rich.table import Table

    title = f"{run.scenario} · {label} · {run.mode} · seed {run.seed}"
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


def _with_interval(value: float | None, interval: Interval | None) -> str:
    """Metres in centimetres with the interval, escaped for rich."""
    if value is None or interval is None:
        return _centimetres(value)
    digits = 2 if interval.high < 0.1 else 1 if interval.high < 1 else 0
    low, middle, high = (f"{100 * number:.{digits}f}" for number in (interval.low, value, interval.high))
    return f"{middle} \\[{low}, {high}]"


def _centimetres(value: float | None) -> str:
    return _plain(None if value is None else value * 100, 2)


def _degrees(value: float | None) -> str:
    return _plain(None if value is None else math.degrees(value), 2)


def _plain(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


_QUANTITIES = (
    ("completeness", "completeness", lambda value: _plain(value, 3)),
    ("E cm", "precision_m", _centimetres),
    ("e cm", "accuracy_m", _centimetres),
    ("Δ °", "precision_rad", _degrees),
    ("δ °", "accuracy_rad", _degrees),
    ("N-AUC", "n_auc", lambda value: _plain(value, 3)),
)
