"""`taskslam figures`: the figures and tables of a paper, from the results of some folders."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from taskslam.cli.console import say

if TYPE_CHECKING:
    from taskslam.report.figures.style import Format, Width


class _Units(StrEnum):
    METRIC = "metric"
    TASK = "task"


class _Width(StrEnum):
    COLUMN = "column"
    PAGE = "page"


class _Preset(StrEnum):
    IEEE_COLUMN = "ieee-column"
    IEEE_WIDE = "ieee-wide"


def figures(
    results: Annotated[list[Path], typer.Argument(help="Run directories, or folders that hold some at any depth.")],
    out: Annotated[Path, typer.Option(help="Folder for the files.")] = Path("figures"),
    kinds: Annotated[str, typer.Option("--format", help="pdf, svg, png; several with commas.")] = "pdf",
    units: Annotated[
        _Units, typer.Option(help="Main axes in cm and degrees, or in the task's D and FoV; the others opposite.")
    ] = _Units.METRIC,
    width: Annotated[
        _Width | None, typer.Option(help="One column of a page (3.5 in), or both (7.16 in); default: column.")
    ] = None,
    preset: Annotated[
        _Preset | None, typer.Option(help="Figures and LaTeX tables that fit one or both columns of an IEEE page.")
    ] = None,
    linear: Annotated[
        bool, typer.Option("--linear", help="Axes from 0, as published; else wide ones are log.")
    ] = False,
    label: Annotated[
        list[str] | None, typer.Option("--label", help="What a method is called: tiny_icp=Ours; may be repeated.")
    ] = None,
    order: Annotated[str, typer.Option(help="Methods that come first, with commas; default: the best first.")] = "",
    columns: Annotated[str, typer.Option(help="Of the LaTeX table of methods: E,C,N-AUC; default: all.")] = "",
) -> None:
    """Draw every figure of a paper and write its tables (LaTeX, Markdown, CSV). The same results give the same bytes.

    What each figure shows: docs/figures.md. A run that cannot be read is named and left out.

    Examples:
        taskslam figures results --out paper/figures

        taskslam figures results --out slides --format png,svg --width page --units task

        taskslam figures results --label tiny_icp=Ours --order Ours,karto --linear --preset ieee-column
    """
    formats = _formats(kinds)

    from taskslam.cli.progress import progress
    from taskslam.report.figures.paper import paper_figures
    from taskslam.report.figures.style import save_figure
    from taskslam.report.results import read_results
    from taskslam.report.tables.layout import Layout, presets
    from taskslam.report.tables.table_files import write_tables

    read = read_results(results, _labels(label or []), _parts(order))
    layout = (presets()[preset.value] if preset else Layout()).with_columns(_parts(columns))
    across: Width = width.value if width else "page" if preset is _Preset.IEEE_WIDE else "column"
    for left in read.left_out:
        say(f"Left out {left.directory}: {left.reason}", err=True)
    with progress(quiet=False) as observer:
        observer.stage("writing tables")
        paths = write_tables(read, out / "tables", layout)
        observer.stage("drawing figures")
        for name, figure in paper_figures(read, across, units.value, linear):
            observer.stage(f"saving {name}")
            paths += save_figure(figure, out, name, formats)
    say(f"Figures and tables: {len(paths)} files in {out}")


def _formats(text: str) -> list[Format]:
    from taskslam.errors import InputError, did_you_mean

    known = ("pdf", "svg", "png")
    wanted = _parts(text.lower())
    for part in wanted:
        if part not in known:
            raise InputError(f"--format {part}: expected some of {', '.join(known)}.{did_you_mean(part, known)}")
    if not wanted:
        raise InputError(f"--format {text!r}: expected some of {', '.join(known)}")
    return cast("list[Format]", wanted)


def _parts(text: str) -> list[str]:
    return list(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))


def _labels(given: list[str]) -> dict[str, str]:
    from taskslam.errors import InputError

    names = {}
    for text in given:
        method, equals, name = text.rpartition("=")
        if not (method.strip() and equals and name.strip()):
            raise InputError(f"--label {text}: expected METHOD=NAME, such as tiny_icp=Ours")
        names[method.strip()] = name.strip()
    return names
