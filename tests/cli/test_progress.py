"""What a user reads while something lasts: on a terminal for how long already, in a log how long it took."""

import io

import pytest
from rich.console import Console
from rich.progress import Progress

from taskslam.cli import progress


class Clock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.now = 0.0

    def perf_counter(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(progress, "time", clock)
    return clock


def test_a_log_names_what_took_long_and_nothing_else(clock):
    console = Console(file=io.StringIO(), width=80)
    lines = progress.Lines(console)
    lines.stage("loading the world")
    clock.now = 12.4
    lines.stage("preparing the floor plan")
    clock.now = 13.0
    lines.stage("starting the method")
    clock.now = 20.0
    lines.ticked(0)
    clock.now = 500.0  # the robot drives
    lines.ticked(1)
    lines.stage("starting the method")
    assert console.file.getvalue() == "  loading the world took 12 s\n  starting the method took 7 s\n"


def test_a_terminal_shows_for_how_long_a_stage_has_been_lasting(clock):
    console = Console(file=io.StringIO(), width=80, force_terminal=True)
    with Progress(*progress._COLUMNS, console=console, auto_refresh=False) as bars:
        bar = progress.Bar(console, bars)
        column = progress._COLUMNS[-1]

        def shown() -> str:
            return column.render(bars.tasks[0]).plain

        bar.run_begins("house, karto")
        bar.stage("loading the world")
        clock.now = 1.0
        assert shown() == ""
        clock.now = 8.2
        assert shown() == "8 s"
        bar.ticked(0)
        clock.now = 9.2
        bar.ticked(4_000_000_000)
        assert shown() == "0.1 min simulated, 4x real time"
