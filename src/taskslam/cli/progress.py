"""Progress on a terminal: simulated time, real-time factor and the current goal. Nothing where nobody watches."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskID, TextColumn

from taskslam.benchmark.observer import Observer
from taskslam.measurements import NANOSECONDS

_REFRESH = 0.2  # s of wall time between two refreshes


class Lines(Observer):
    """For logs and pipes: notices only, one line each, on standard error."""

    def __init__(self, console: Console) -> None:
        self._console = console

    def run_begins(self, title: str) -> None:
        """A run begins."""
        self._console.print(title, highlight=False)

    def notice(self, text: str) -> None:
        """Print a line."""
        self._console.print(f"  {text}", highlight=False, markup=False, soft_wrap=True)


class Silent(Lines):
    """For --quiet: only what went wrong is said, and that by the tables."""

    def run_begins(self, title: str) -> None:
        """Say nothing."""

    def notice(self, text: str) -> None:
        """Say nothing."""


class Bar(Lines):
    """For a terminal."""

    def __init__(self, console: Console, bars: Progress) -> None:
        super().__init__(console)
        self._bars = bars
        self._task: TaskID = bars.add_task("", total=None, info="")
        self._title = ""
        self._where = ""
        self._goals = (0, 1)
        self._rounds = (0, 1)
        self._begun = self._shown = time.perf_counter()
        self._first_tick: int | None = None

    def stage(self, text: str) -> None:
        """Show a step of the preparation."""
        self._bars.update(self._task, description=text, total=None)

    def run_begins(self, title: str) -> None:
        """Start a fresh bar."""
        self._title = title
        self._begun, self._first_tick = time.perf_counter(), None

    def round_begins(self, number: int, total: int, priming: bool) -> None:
        """Show the round."""
        self._rounds = (number, total)
        self._where = "priming round" if priming else f"round {number + 1}/{total}"

    def heading_for(self, goal: int, goals: int) -> None:
        """Show the goal."""
        self._goals = (goal, goals)
        self._bars.update(
            self._task,
            description=f"{self._title}  {self._where}  goal {goal + 1}/{goals}",
            total=self._rounds[1] * goals,
            completed=self._rounds[0] * goals + goal,
        )

    def ticked(self, now: int) -> None:
        """Show simulated time and real-time factor a few times a second."""
        wall = time.perf_counter()
        if self._first_tick is None:
            self._first_tick, self._begun = now, wall
        if wall - self._shown < _REFRESH:
            return
        self._shown = wall
        simulated = now / NANOSECONDS
        factor = (now - self._first_tick) / NANOSECONDS / max(wall - self._begun, 1e-9)
        self._bars.update(self._task, info=f"{simulated / 60:.1f} min simulated, {factor:.0f}x real time")


@contextmanager
def progress(quiet: bool) -> Iterator[Lines]:
    """The observer that fits where standard error goes."""
    console = Console(stderr=True)
    if quiet:
        yield Silent(console)
        return
    if not console.is_terminal:
        yield Lines(console)
        return
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TextColumn("[dim]{task.fields[info]}"),
    )
    with Progress(*columns, console=console, transient=True) as bars:
        yield Bar(console, bars)
