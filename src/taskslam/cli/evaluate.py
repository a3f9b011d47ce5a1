"""`taskslam evaluate`: tables on the screen, metrics.json in the folder."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import say, standard_output
from taskslam.mode import Mode

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from taskslam.evaluation import MetricsFile, RunMetrics
    from taskslam.evaluation.metrics_file import Measured, Row
    from taskslam.report.tables.columns import Column

_FEW_RUNS, _MOST_RUNS = 40, 500  # shown by waypoint; shown at all
_MOST_PAIRS = 10  # of methods, whose comparison is shown
_EVERYTHING, _WITH_INTERVALS = 100, 190  # columns of the screen: for all quantities, and for their intervals


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
        say(f"{len(metrics.runs):,} runs are too many for a table: they are in metrics.json.")
    elif metrics.runs:
        _print_summary(console, metrics, labels)
    for said in (sentence for run in metrics.runs for sentence in run.journal_damaged):
        say(f"Damaged: {said}", err=True)
    for said in (sentence for run in metrics.runs for sentence in run.files_changed):
        say(f"Changed: {said}", err=True)
    for left in metrics.left_out:
        say(f"Left out {directory / left.directory}: {left.reason}", err=True)
    say(f"Metrics: {path}")


def _print_summary(console: Console, metrics: MetricsFile, labels: Sequence[str]) -> None:
    """Two tables a scenario: how well it went, and what it took; a method's seeds in one row.

    Where the screen is narrow, the essential alone.
    """
    from taskslam.report.tables.columns import COMPLETE, DROPPED, REAL_TIME, quantity_columns

    everything, wide = console.width >= _EVERYTHING, console.width >= _WITH_INTERVALS
    columns = [COMPLETE, *quantity_columns(essential=not everything)]
    effort_of = (REAL_TIME, DROPPED)
    for scenario in sorted({run.scenario for run in metrics.runs}):
        results = _table(f"{scenario}: results", tuple(column.heading for column in columns))
        took = ("failures", "sim. min", *(column.heading for column in effort_of), "method MB")
        effort = _table(f"{scenario}: effort", took)
        for row in metrics.rows:
            if row.scenario != scenario:
                continue
            entry = _Entry(row)
            results.add_row(*_whose(row), *(_cell(column, entry, wide) for column in columns))
            effort.add_row(
                *_whose(row),
                str(sum(row.failures_by_kind.values())),
                f"{row.simulated_s / 60:.1f}",
                *(column.text(entry) for column in effort_of),
                _plain(row.method_peak_bytes and row.method_peak_bytes / 1e6, 0),
            )
        console.print(results)
        console.print(effort)
    console.print(_legend(everything, wide))
    _print_comparisons(console, metrics)
    if metrics.deviations:
        _print_deviations(console, metrics, labels)


@dataclass(frozen=True)
class _Entry:
    """A method over its seeds as a row of a table."""

    numbers: Row

    @property
    def quantities(self) -> Mapping[str, Measured]:
        return self.numbers.quantities


def _cell(column: Column, row: _Entry, wide: bool) -> str:
    """The value, and on a wide screen its interval."""
    between = column.interval(row) if wide else ""
    return f"{column.text(row)} [{between}]" if between else column.text(row)


def _legend(everything: bool, wide: bool) -> str:
    """What the symbols mean, a line each."""
    from taskslam.evaluation.quantities import quantities

    shown = [one for one in quantities() if everything or one.essential]
    room = max(len(one.symbol) for one in shown)
    more = "in [ ] the 95 % interval" if wide else f"{_WITH_INTERVALS} columns show all quantities and intervals"
    return "\n".join(
        [
            *(f"  {one.symbol:{room}}  {one.words}" for one in shown),
            f"Means are over waypoints reached in every round; {more}.",
        ]
    )


def _print_comparisons(console: Console, metrics: MetricsFile) -> None:
    """The verdicts on precision; of many pairs, how many could be told apart."""
    for mode in Mode:
        found = [c for c in metrics.comparisons if c.mode == mode and c.metric == "precision"]
        if len(found) > _MOST_PAIRS:
            apart = sum(comparison.told_apart for comparison in found)
            console.print(
                f"\nPrecision {mode.words}: {apart} of {len(found)} pairs told apart; they are in metrics.json."
            )
        elif found:
            console.print(f"\nPrecision {mode.words}:")
            for comparison in found:
                console.print(f"  {comparison.verdict}")


def _print_deviations(console: Console, metrics: MetricsFile, labels: Sequence[str]) -> None:
    """What the published code makes of each run, what the definitions give, and the difference."""
    names = ("as published", "by definition", "difference")
    table = _table(f"Deviations of the published code: {', '.join(metrics.deviations)}", ("quantity", *names), "seed")
    for label, run in zip(labels, metrics.runs, strict=True):
        if run.by_definition is None:
            continue
        for field in type(run.by_definition).model_fields:
            published, right = getattr(run.headline, field), getattr(run.by_definition, field)
            if published != right and not math.isclose(published or 0.0, right or 0.0, rel_tol=1e-4):
                difference = None if published is None or right is None else published - right
                what = field.replace("_m", " cm").replace("_rad", " °")
                table.add_row(*_who(label, run), what, *(_shown(field, one) for one in (published, right, difference)))
    if table.row_count:
        console.print(table)
    else:
        console.print("\nThe published code gives the same numbers for these runs.")


def _table(title: str, columns: tuple[str, ...], seeds: str = "seeds") -> Table:
    from rich import box
    from rich.table import Table

    table = Table(
        title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0)
    )
    table.add_column("method", overflow="fold", min_width=12)
    table.add_column("map", no_wrap=True)
    table.add_column(seeds, no_wrap=True, justify="right")
    for name in columns:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def _whose(row: Row) -> tuple[str, str, str]:
    seeds = len(set(row.seeds))
    return (row.method, Mode(row.mode).short, "one" if seeds == 1 else str(seeds))


def _who(label: str, run: RunMetrics) -> tuple[str, str, str]:
    return (label, Mode(run.mode).short, str(run.seed))


def _waypoint_table(label: str, run: RunMetrics) -> Table:
    from rich import box
    from rich.table import Table

    from taskslam.evaluation.quantities import quantities
    from taskslam.report.tables.columns import quantity_heading, quantity_text

    title = f"{run.scenario} · {label} · {run.mode} · seed {run.seed}"
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    shown = [one for one in quantities() if any(one.key in waypoint.quantities for waypoint in run.waypoints)]
    for name in ("waypoint", "visits", *map(quantity_heading, shown), "control cm", "estimation cm"):
        table.add_column(name, justify="right", no_wrap=True)
    for waypoint in run.waypoints:
        table.add_row(
            str(waypoint.goal + 1),
            f"{waypoint.visits}/{waypoint.rounds}",
            *(quantity_text(one, waypoint.quantities.get(one.key)) for one in shown),
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


def _shown(field: str, value: float | None) -> str:
    """A published number by its field, whose ending is its unit."""
    if field.endswith("_m"):
        return _centimetres(value)
    return _degrees(value) if field.endswith("_rad") else _plain(value, 3)
