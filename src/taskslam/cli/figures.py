"""`taskslam figures`: the figures and tables of a paper, from the results of some folders."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from taskslam.cli.console import say

if TYPE_CHECKING:
    from taskslam.report.figures.style import Format


class _Units(StrEnum):
    METRIC = "metric"
    TASK = "task"


class _Width(StrEnum):
    COLUMN = "column"
    PAGE = "page"


def figures(
    results: Annotated[list[Path], typer.Argument(help="Run directories, or folders that hold some at any depth.")],
    out: Annotated[Path, typer.Option(help="Folder for the files.")] = Path("figures"),
    kinds: Annotated[str, typer.Option("--format", help="pdf, svg, png; several with commas.")] = "pdf",
    units: Annotated[
        _Units, typer.Option(help="Main axes in cm and degrees, or in the task's D and FoV; the others opposite.")
    ] = _Units.METRIC,
    width: Annotated[_Width, typer.Option(help="One column of a page (3.5 in), or both (7.16 in).")] = _Width.COLUMN,
) -> None:
    """Draw every figure of a paper and write its tables (LaTeX, Markdown, CSV). The same results give the same bytes.

    What each figure shows: docs/figures.md. A run that cannot be read is named and left out.

    Examples:
        taskslam figures results --out paper/figures

        taskslam figures results --out slides --format png,svg --width page --units task
    """
    formats = _formats(kinds)

    from taskslam.report.figures.paper import paper_figures
    from taskslam.report.figures.style import save_figure
    from taskslam.report.results import read_results
    from taskslam.report.tables.table_files import write_tables

    read = read_results(results)
    for left in read.left_out:
        say(f"Left out {left.directory}: {left.reason}", err=True)
    paths = write_tables(read, out / "tables")
    for name, figure in paper_figures(read, width.value, units.value):
        paths += save_figure(figure, out, name, formats)
    say(f"Figures and tables: {len(paths)} files in {out}")


def _formats(text: str) -> list[Format]:
    from taskslam.errors import InputError, did_you_mean

    known = ("pdf", "svg", "png")
    wanted = list(dict.fromkeys(part.strip().lower() for part in text.split(",") if part.strip()))
    for part in wanted:
        if part not in known:
            raise InputError(f"--format {part}: expected some of {', '.join(known)}.{did_you_mean(part, known)}")
    if not wanted:
        raise InputError(f"--format {text!r}: expected some of {', '.join(known)}")
    return cast("list[Format]", wanted)
