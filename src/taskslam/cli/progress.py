"""Progress on a terminal: simulated time, real-time factor and the current goal. Nothing where nobody watches."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, SpinnerColumn, Task, TaskID, TextColumn
from rich.text import Text

from taskslam.benchmark.engine import Result, Watcher
from taskslam.benchmark.spec import RunSpec
from taskslam.cli.console import standard_error
from taskslam.measurements import NANOSECONDS
from taskslam.observer import Observer

_REFRESH = 0.2  # s of wall time between two refreshes
_LONG = 3.0  # s after which one asks how long a stage has been lasting


class _InfoColumn(ProgressColumn):
    """What a bar says of itself; of a stage that lasts, for how long already."""

    def render(self, task: Task) -> Text:
        since = task.fields.get("since")
        lasts = 0.0 if since is None else time.perf_counter() - since
        return Text(f"{lasts:.0f} s" if lasts >= _LONG else task.fields["info"], style="dim")


_COLUMNS = (SpinnerColumn(), TextColumn("{task.description}", markup=False), BarColumn(bar_width=24), _InfoColumn())


class Lines(Observer):
    """For logs and pipes: notices and what took long, one line each, on standard error."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._stage, self._since = "", 0.0

    def stage(self, text: str) -> None:
        """Print how long the stage before lasted, if that was long."""
        now = time.perf_counter()
        if self._stage and now - self._since >= _LONG:
            self.notice(f"{self._stage} took {now - self._since:.0f} s")
        self._stage, self._since = text, now

    def run_begins(self, title: str) -> None:
        """A run begins."""
        self._console.print(title, highlight=False)

    def ticked(self, now: int) -> None:  # noqa: ARG002
        """The robot lives: the preparation is over."""
        if self._stage:
            self.stage("")

    def notice(self, text: str) -> None:
        """Print a line."""
        self._console.print(f"  {text}", highlight=False, soft_wrap=True)


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
        self._task: TaskID = bars.add_task("", total=None, info="", since=None)
        self._title = ""
        self._where = ""
        self._goals = (0, 1)
        self._rounds = (0, 1)
        self._begun = self._shown = time.perf_counter()
        self._first_tick: int | None = None

    def stage(self, text: str) -> None:
        """Show a step of the preparation, and for how long it has been lasting."""
        since = time.perf_counter() if text else None
        self._bars.update(self._task, description=text or self._title, total=None, since=since)
        super().stage(text)

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
        super().ticked(now)
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
    console = standard_error()
    if quiet:
        yield Silent(console)
        return
    if not console.is_terminal:
        yield Lines(console)
        return
    with Progress(*_COLUMNS, console=console, transient=True) as bars:
        yield Bar(console, bars)


class SuiteLines(Watcher):
    """For logs and pipes: a line when a run ends."""

    def __init__(self, console: Console, total: int) -> None:
        self._console = console
        self._total = total
        self._ended = 0

    def ends(self, result: Result) -> None:
        """Print the result."""
        self._ended += 1
        detail = f": {result.detail}" if result.detail else ""
        line = f"[{self._ended}/{self._total}] {result.title}: {result.ending}{detail}"
        self._console.print(line, highlight=False, soft_wrap=True)


class SuiteBars(SuiteLines):
    """For a terminal: a bar for the whole and one for each run under way."""

    def __init__(self, console: Console, bars: Progress, total: int) -> None:
        super().__init__(console, total)
        self._bars = bars
        self._whole = bars.add_task("all runs", total=total, info="")
        self._running: dict[str, TaskID] = {}

    def begins(self, spec: RunSpec) -> None:
        """Add the run's bar."""
        self._running[spec.digest] = self._bars.add_task(f"  {spec.title}", total=1.0, info="")

    def goes_on(self, spec: RunSpec, progress: dict[str, object]) -> None:
        """Move the run's bar."""
        if "done" in progress:
            minutes = float(str(progress["simulated_s"])) / 60
            self._bars.update(
                self._running[spec.digest], completed=float(str(progress["done"])), info=f"{minutes:.1f} min simulated"
            )

    def ends(self, result: Result) -> None:
        """Remove the run's bar, print the result."""
        if result.spec is not None and (task := self._running.pop(result.spec.digest, None)) is not None:
            self._bars.remove_task(task)
        super().ends(result)
        self._bars.update(self._whole, completed=self._ended)


@contextmanager
def suite_progress(quiet: bool, total: int) -> Iterator[Watcher]:
    """The watcher that fits where standard error goes."""
    console = standard_error()
    if quiet:
        yield Watcher()
    elif not console.is_terminal:
        yield SuiteLines(console, total)
    else:
        with Progress(*_COLUMNS, console=console, transient=True) as bars:
            yield SuiteBars(console, bars, total)
