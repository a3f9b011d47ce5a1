"""`taskslam runs`: the runs under a folder as a table, chosen, ordered and exported."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import say, standard_output

if TYPE_CHECKING:
    import polars as pl

_SHOWN = "scenario,method,options,latency,robot,mode,seed,completeness,precision_cm,accuracy_cm,failure"


class ExportChoice(StrEnum):
    """Formats by the ends of their files."""

    CSV = ".csv"
    PARQUET = ".parquet"
    JSON = ".json"


def runs(
    directory: Annotated[Path, typer.Argument(help="A folder that holds runs at any depth.")],
    where: Annotated[str, typer.Option(help="Of which this is true, as in SQL: method = 'karto' and seed < 3.")] = "",
    columns: Annotated[str, typer.Option(help="Comma-separated; `all` for all.")] = _SHOWN,
    sort: Annotated[str, typer.Option(help="A column; with a - before it, the largest first.")] = "",
    by: Annotated[str, typer.Option(help="Comma-separated columns: one line for all runs that agree in them.")] = "",
    most: Annotated[int, typer.Option(min=1, help="Lines that are shown.")] = 50,
    export: Annotated[Path | None, typer.Option(help="Also write them: .csv, .json or .parquet by its end.")] = None,
) -> None:
    """List runs: what was driven, and what it reached. E and e are precision_cm and accuracy_cm.

    Rows are numbered, for the option --row of `taskslam verify`. What has been read once is kept in
    DIRECTORY/runs.parquet, which can be deleted. Exit status: 2 if a run cannot be read, which is named.

    Examples:
        taskslam runs results

        taskslam runs results --where "method = 'karto' and completeness = 1" --sort -precision_cm

        taskslam runs results --by method,mode --export methods.csv
    """
    from taskslam.evaluation.run_index import chosen, index_runs

    index = index_runs(directory)
    table = index.table.with_row_index("row")
    if where:
        table = chosen(table, where)
    if by:
        table = _grouped(table, _known(table, by, "--by"))
    elif columns != "all":
        table = table.select("row", *_known(table, columns, "--columns"))
    if sort:
        (column,) = _known(table, sort.removeprefix("-"), "--sort")
        table = table.sort(column, descending=sort.startswith("-"), nulls_last=True)
    _show(table, most)
    if export is not None:
        _write(table, export)
        say(f"Written: {export}")
    for left in index.left_out:
        say(f"Left out {directory / left.directory}: {left.reason}", err=True)
    raise typer.Exit(2 if index.left_out else 0)


def _known(table: pl.DataFrame, text: str, option: str) -> list[str]:
    from taskslam.errors import InputError, did_you_mean

    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in table.columns:
            hint = did_you_mean(name, table.columns)
            raise InputError(f"{option} {name}: no such column; expected some of {', '.join(table.columns)}.{hint}")
    return names


def _grouped(table: pl.DataFrame, keys: list[str]) -> pl.DataFrame:
    """A row for each combination: how many runs, how many complete, and means of what is a number."""
    import polars as pl

    means = ("completeness", "precision_cm", "accuracy_cm", "n_auc", "wall_s")
    return table.group_by(keys, maintain_order=True).agg(
        pl.len().alias("runs"),
        pl.col("complete").sum().alias("complete"),
        *(pl.col(name).mean() for name in means if name not in keys),
    )


def _show(table: pl.DataFrame, most: int) -> None:
    from rich.table import Table

    shown = Table()
    for name, kind in table.schema.items():
        shown.add_column(name, justify="right" if kind.is_numeric() else "left")
    for row in table.head(most).iter_rows():
        shown.add_row(*(_word(value) for value in row))
    standard_output().print(shown)
    more = f", of which {most} are shown" if len(table) > most else ""
    say(f"{len(table):,} lines{more}")


def _word(value: object) -> str:
    if value is None or value == "":
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _write(table: pl.DataFrame, path: Path) -> None:
    import io

    from taskslam.errors import InputError
    from taskslam.files import write_whole

    data = io.BytesIO()
    match path.suffix:
        case ExportChoice.CSV:
            table.write_csv(data)
        case ExportChoice.JSON:
            table.write_json(data)
        case ExportChoice.PARQUET:
            table.write_parquet(data)
        case _:
            raise InputError(f"--export {path}: expected a name that ends in {', '.join(ExportChoice)}")
    write_whole(path, data.getvalue())
