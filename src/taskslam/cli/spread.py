"""`taskslam spread`: where does a method's spread come from: the sensors' noise, its own seed, or its threads?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import say, standard_output
from taskslam.cli.options import WorldPaths
from taskslam.mode import Mode

if TYPE_CHECKING:
    from rich.table import Table

    from taskslam.benchmark.spread import SpreadRun
    from taskslam.evaluation.spread_shares import Share


def spread(
    scenario: Annotated[str, typer.Argument(help="A shipped scenario (house, office, ...) or a YAML file.")],
    method: Annotated[str, typer.Option("--method", "-m", help="Whose spread.")],
    method_seed: Annotated[
        str, typer.Option(help="The option with which the method is told its own seed, as seed; default: it has none.")
    ] = "",
    option: Annotated[list[str] | None, typer.Option("--option", help="Of the method, KEY=VALUE.")] = None,
    mode: Annotated[Mode, typer.Option(help="Without map, or with map.")] = Mode.WITHOUT_MAP,
    runs: Annotated[int, typer.Option(min=2, help="Of each part: ten tell a share to about a half.")] = 10,
    groups: Annotated[int, typer.Option(min=1, help="Values at which a source is held.")] = 2,
    rounds: Annotated[int, typer.Option(min=2, help="Of each run.")] = 5,
    robot: Annotated[str, typer.Option(help="A shipped robot or a YAML file; default: the scenario's.")] = "",
    jobs: Annotated[int, typer.Option("--jobs", "-j", min=1, help="Cores to use.")] = 1,
    out: Annotated[Path, typer.Option(help="Folder for run directories.")] = Path("spread"),
    world_path: WorldPaths = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Hold the sensors' noise and the method's own seed fixed in turn, drive the same again, and share out the spread.

    What differs is log E, precision's logarithm. Runs in which all differs are set against runs in which one source is
    held; what differs where the very same run is driven again is owed to threads. Start it again after a stop: it goes
    on.

    Exit status: 0; 1 too few runs have a precision to say anything; 2 wrong input; 3 a run could not be driven.

    Examples:
        taskslam spread house -m gf_gg --method-seed seed --jobs 2

        taskslam spread office -m orb_slam3 --runs 6 --out orb_spread
    """
    from taskslam.benchmark.engine import DRIVEN
    from taskslam.benchmark.engines.local import LocalEngine
    from taskslam.benchmark.spread import drive_spread, shares_in, spread_runs
    from taskslam.benchmark.stage import folders_of, set_stage
    from taskslam.cli.options import parse_options
    from taskslam.cli.progress import progress, suite_progress
    from taskslam.errors import InputError
    from taskslam.scenario import load_scenario
    from taskslam.slam.registry import find_method

    find_method(method)
    place = load_scenario(scenario, [f"protocol.rounds={rounds}", *([f"robot={robot}"] if robot else [])])
    with progress(quiet) as observer:
        stage = set_stage(place, world_path or [], observer)
    spec = stage.spec(method, mode, 0, parse_options(option or []))
    try:
        planned = spread_runs(spec, runs, groups, method_seed or None)
    except ValueError as error:
        raise InputError(f"--runs {runs} --groups {groups}: {error}") from None
    engine = LocalEngine(jobs, (*(world_path or ()), *folders_of(place)))
    with suite_progress(quiet, len({run.place(out) for run in planned})) as watcher:
        lost = [result for result in drive_spread(planned, engine, out, watcher) if result.ending not in DRIVEN]
    for result in lost:
        say(f"{result.title}: {result.ending}: {result.detail}", err=True)
    if lost:
        raise typer.Exit(3)
    values = {place: _log_precision(place) for place in {run.place(out) for run in planned}}
    try:
        shares = shares_in(planned, lambda run: values[run.place(out)])
    except ValueError as error:
        say(f"Nothing can be shared out: {error}.")
        raise typer.Exit(1) from None
    standard_output().print(_table(shares))
    say(_words(planned, values, out))


def _log_precision(place: Path) -> float:
    from taskslam.evaluation import run_metrics
    from taskslam.evaluation.spread_shares import log_precision
    from taskslam.record import load_run

    return log_precision(run_metrics(load_run(place), str(place)))


def _table(shares: Sequence[Share]) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("source")
    for name in ("share of the variance of log E", "95 % interval", "runs"):
        table.add_column(name, justify="right")
    for one in shares:
        ends = f"{one.interval.low:.0%} to {one.interval.high:.0%}"
        table.add_row(one.source, f"{one.share:.0%}", ends, str(one.runs))
    return table


def _words(planned: Sequence[SpreadRun], values: dict[Path, float], out: Path) -> str:
    """How large that is which was shared out."""
    from taskslam.benchmark.spread import EVERYTHING

    known = [values[run.place(out)] for run in planned if run.part == EVERYTHING]
    known = [value for value in known if not math.isnan(value)]
    return (
        f"Shared out: over {len(known)} runs in which everything differs, E is {100 * math.exp(fmean(known)):.2f} cm,"
        f" and one run in three is off by more than a factor of {math.exp(stdev(known)):.2f}. Shares need not add up to"
        " 100 %: what is left is interaction, and chance."
    )
