"""`taskslam watch`: a campaign or a run, while it is driven or afterwards, in the browser or on the terminal."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import standard_output
from taskslam.cli.served_page import serve_page

if TYPE_CHECKING:
    from rich.console import Group, RenderableType
    from rich.table import Table

    from taskslam.benchmark.campaign.watching import Look, Watched

_EVERY = 2.0  # s between two looks
_MOST_NAMED = 5  # events of a run, on the terminal


def watch(
    folder: Annotated[Path, typer.Argument(help="Of a campaign, of several runs, or of one.")],
    terminal: Annotated[bool, typer.Option("--terminal", "-t", help="Here, without a browser.")] = False,
    port: Annotated[int, typer.Option(min=0, max=65535, help="On which the page is served; 0 for any.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page.")] = True,
) -> None:
    """Watch runs while they are driven: how far each is, when all will be done, and the robot on its plan.

    The page is served to this machine alone. Nothing is written into the folder. On a terminal, or into a pipe, which
    is told once. Ctrl-C ends it, and not the runs.

    Examples:
        taskslam watch tuning

        taskslam watch tuning/house/karto/without-map/seed0 --terminal
    """
    from taskslam.benchmark.campaign.watching import Watched

    watched = Watched(folder)
    if terminal:
        _on_terminal(watched)
        return
    from taskslam.report.page.watch_page import WatchPage

    serve_page(WatchPage(watched), port, browser, ", and not the runs")


def _on_terminal(watched: Watched) -> None:
    from rich.live import Live

    console = standard_output()
    if not console.is_terminal:
        console.print(_shown(watched, watched.look()))
        return
    with Live(_shown(watched, watched.look()), console=console, auto_refresh=False) as live:
        while True:
            time.sleep(_EVERY)
            live.update(_shown(watched, watched.look()), refresh=True)


def _shown(watched: Watched, look: Look) -> Group:
    """Counts, the end, a table of methods and places, and what is being driven, with what happened last."""
    from rich.console import Group
    from rich.text import Text

    from taskslam.report.watch_words import SIGNS, counts_in_words, happened, outlook_in_words, where_in_words

    legend = "  ".join(f"{sign} {words}" for sign, words in SIGNS.items())
    lines: list[RenderableType] = [
        Text(counts_in_words(look), style="bold"),
        Text(outlook_in_words(look)),
        _table(look),
        Text(legend, style="dim"),
    ]
    for run in look.under_way or (look.runs if len(look.runs) == 1 else ()):
        closer = watched.closer(run)
        lines.append(Text(f"{run.title}: {where_in_words(closer)}", style="green"))
        told = [told for told in happened(closer) if told.kind != "round"][:_MOST_NAMED]
        lines += [Text(f"  {one.when}  {one.what}", style="red" if one.kind == "failure" else "dim") for one in told]
    return Group(*lines)


def _table(look: Look) -> Table:
    """A sign for each run, by method and mode, and places."""
    from rich.table import Table
    from rich.text import Text

    from taskslam.report.watch_words import sign_of

    places = list(dict.fromkeys(run.scenario for run in look.runs))
    table = Table()
    for heading in ("method", "mode", *places):
        table.add_column(Text(heading))
    cells: dict[tuple[str, str], dict[str, str]] = {}
    for run in sorted(look.runs, key=lambda run: run.seed):
        row = cells.setdefault((run.way, run.mode), dict.fromkeys(places, ""))
        row[run.scenario] += sign_of(run)
    for (way, mode), row in sorted(cells.items()):
        table.add_row(Text(way), Text(mode), *map(Text, row.values()))
    return table
