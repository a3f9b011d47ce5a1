"""`taskslam choose`: which method for my robot, at my places, within my tolerance?"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import say, standard_output
from taskslam.cli.options import WorldPaths
from taskslam.mode import Mode

if TYPE_CHECKING:
    from rich.table import Table

    from taskslam.benchmark.choosing import Driver
    from taskslam.evaluation.choice import Standing

METHODS = "karto,hector,dsol,gf_gg,fast_lio2,rko_lio,orb_slam3,wheel_odometry"
_AMOUNT = re.compile(r"(\d+(?:\.\d*)?)\s*([a-z°]+)")
_LENGTHS = {"mm": 0.001, "cm": 0.01, "m": 1.0}
_TIMES = {"min": 60.0, "h": 3600.0}


def choose(
    places: Annotated[list[str], typer.Argument(help="Scenarios: shipped ones (house, office, ...) or YAML files.")],
    tolerance: Annotated[str, typer.Option(help="Within which your robot must come back: 2cm, 5mm.")],
    robot: Annotated[str, typer.Option(help="A shipped robot or a YAML file; default: each scenario's.")] = "",
    heading: Annotated[float, typer.Option(min=0.0, help="The same for its heading, degrees; 0: any.")] = 0.0,
    methods: Annotated[str, typer.Option(help="Comma-separated candidates.")] = METHODS,
    mode: Annotated[Mode, typer.Option(help="Without map, or with map.")] = Mode.WITHOUT_MAP,
    rounds: Annotated[int, typer.Option(min=2, help="Rounds of each seed.")] = 3,
    cpu_scale: Annotated[
        float | None, typer.Option(help="Your robot's processor is so many times slower: latency is measured.")
    ] = None,
    seeds: Annotated[int, typer.Option(min=2, help="At most so many.")] = 20,
    budget: Annotated[str, typer.Option(help="Time of one core for all of it: 2h is an hour on two cores.")] = "2h",
    jobs: Annotated[int, typer.Option("--jobs", "-j", min=1, help="Cores to use.")] = 1,
    out: Annotated[Path, typer.Option(help="Folder for run directories.")] = Path("choice"),
    world_path: WorldPaths = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Name the method that brings a robot back within a tolerance most often, with its probability and its price.

    Seed after seed is driven; a method that can hardly be the best any more is dropped. It ends when one is the best
    with 95 %, or the budget is used up. Of methods that succeed alike, the one that takes less processor time is
    chosen. Start it again with a larger budget, and it goes on.

    Exit status: 0 one method is the best with 95 %; 1 the budget did not suffice for that; 2 wrong input; 3 nothing
    could be driven.

    Examples:
        taskslam choose house --tolerance 2cm --jobs 2

        taskslam choose house my_tour.yaml --robot my_robot.yaml --tolerance 2cm --cpu-scale 4 --methods karto,hector
    """
    from taskslam.benchmark.choosing import Driver, Tolerance
    from taskslam.benchmark.engines.local import LocalEngine
    from taskslam.benchmark.stage import folders_of, set_stage
    from taskslam.cli.progress import progress, suite_progress
    from taskslam.evaluation.choice import race
    from taskslam.scenario import load_scenario
    from taskslam.slam.guest.latency import LatencyMode, LatencyModel
    from taskslam.slam.registry import find_method

    candidates = [word.strip() for word in methods.split(",") if word.strip()]
    for name in candidates:
        find_method(name)
    within = Tolerance(_amount("--tolerance", tolerance, _LENGTHS), math.radians(heading) if heading else math.inf)
    budget_s = _amount("--budget", budget, _TIMES)
    latency = LatencyModel() if cpu_scale is None else LatencyModel(LatencyMode.MEASURED, cpu_scale)
    overrides = [f"protocol.rounds={rounds}", *([f"robot={robot}"] if robot else [])]
    with progress(quiet) as observer:
        scenarios = [load_scenario(place, overrides) for place in places]
        stages = [set_stage(scenario, world_path or [], observer) for scenario in scenarios]
    folders = tuple(dict.fromkeys([*(world_path or []), *(one for own in scenarios for one in folders_of(own))]))
    standing: tuple[Standing, ...] = ()
    with suite_progress(quiet, len(candidates) * len(stages) * seeds) as watcher:
        driver = Driver(stages, mode, latency, within, LocalEngine(jobs, folders), watcher, out, budget_s)
        for standing in race(candidates, driver.drive, most_seeds=seeds):
            say(f"After {words_of(standing[0].seeds)}: {_first(standing)}; {_spent(driver)}")
    for result in driver.refused:
        say(f"{result.title}: {result.ending}: {result.detail}", err=True)
    if not standing:
        say("No method could be driven at all places.", err=True)
        raise typer.Exit(3)
    standard_output().print(_table(standing, driver, tolerance, cpu_scale or 1.0))
    raise typer.Exit(_conclude(standing, driver))


def words_of(seeds: int) -> str:
    """`one seed`, `3 seeds`."""
    return "one seed" if seeds == 1 else f"{seeds} seeds"


def _conclude(standing: Sequence[Standing], driver: Driver) -> int:
    from taskslam.evaluation.choice import SURE

    best = standing[0]
    if best.seeds == 1:
        say(f"Not decided: one seed names nobody, and {_spent(driver)} are spent. Give a larger --budget.")
        return 1
    rivals = [one for one in standing[1:] if not one.dropped]
    sure = best.probability >= SURE or not rivals
    what = f"{best.method} is the best of {len(standing)} with a probability of {best.probability:.0%}"
    say(f"{what}, after {words_of(best.seeds)} and {_spent(driver)}.")
    if sure:
        return 0
    near = ", ".join(f"{one.method} {one.probability:.0%}" for one in rivals[:3])
    why = "the budget reaches for no further seed" if driver.exhausted else "the seeds are used up"
    say(f"Not decided: {why}. Nearest: {near}." if near else f"Not decided: {why}.")
    return 1


def _first(standing: Sequence[Standing]) -> str:
    best = standing[0]
    if best.seeds == 1:
        return f"{best.method} is ahead with {best.share:.0%} of its arrivals within tolerance"
    return f"{best.method} is the best with {best.probability:.0%}"


def _spent(driver: Driver) -> str:
    return f"{driver.spent_s / 60:.0f} min of one core"


def _table(standing: Sequence[Standing], driver: Driver, tolerance: str, cpu_scale: float) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("method")
    for name in ("probability", f"within {tolerance}", "seeds", "cores busy", "MB", "min of one core"):
        table.add_column(name, justify="right")
    for one in standing:
        runs = driver.metrics[one.method]
        peak = max((run.method_peak_bytes or 0 for run in runs), default=0)
        table.add_row(
            one.method,
            f"{one.probability:.0%}" + (" dropped" if one.dropped else ""),
            f"{one.share:.0%}",
            str(one.seeds),
            f"{one.cost * cpu_scale:.2g}",
            f"{peak / 1e6:.0f}" if peak else "–",
            f"{sum(run.wall_s for run in runs) / 60:.1f}",
            style="dim" if one.dropped else None,
        )
    return table


def _amount(option: str, text: str, units: dict[str, float]) -> float:
    """A positive number with a unit, in SI. Raises InputError."""
    from taskslam.errors import InputError

    found = _AMOUNT.fullmatch(text.strip())
    if found is None or found[2] not in units or not float(found[1]) > 0:
        known = " or ".join(units)
        raise InputError(f"{option} {text}: expected a number above 0 with {known}, such as 2{[*units][1]}")
    return float(found[1]) * units[found[2]]
