"""`taskslam campaign`: many runs from one file, on this machine or a cluster, resumed and collected."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import say, standard_output
from taskslam.cli.options import WorldPaths
from taskslam.stopping import StoppedError

if TYPE_CHECKING:
    from rich.table import Table

    from taskslam.benchmark.campaign.plan_file import KeptPlan
    from taskslam.benchmark.campaign.planning import Plan
    from taskslam.benchmark.campaign.price import Price, Prices
    from taskslam.benchmark.campaign.state import RunState
    from taskslam.benchmark.engine import Engine, Result

app = typer.Typer(no_args_is_help=True, help="Many runs from one file, on this machine or a cluster.")

_MOST_NAMED = 20  # runs that could not be driven, each with its reason
_HOUR = 3600.0


class EngineChoice(StrEnum):
    """Where runs are driven."""

    LOCAL = "local"
    SLURM = "slurm"
    RAY = "ray"


File = Annotated[str, typer.Argument(help="A campaign (paper), a YAML file, or the folder of one that was begun.")]
Out = Annotated[Path | None, typer.Option(help="Folder of the runs; default: the campaign's name.")]
Worlds = Annotated[str, typer.Option(help="Comma-separated sets of its scenarios, as builtin,aws; default: all.")]
EngineOption = Annotated[EngineChoice, typer.Option(help="Where runs are driven.")]
Jobs = Annotated[
    int | None, typer.Option("--jobs", "-j", min=1, help="Cores that the local engine may use; default: all.")
]
Submit = Annotated[
    list[str] | None,
    typer.Option("--sbatch", help="An option of sbatch, as --sbatch=--partition=long; may be repeated."),
]
Address = Annotated[str, typer.Option(help="Of the Ray cluster; default: one on this machine.")]
Cheapest = Annotated[bool, typer.Option("--cheapest-first", help="In the order of their prices.")]
UntilDecided = Annotated[
    bool, typer.Option("--until-decided", help="Seed by seed, and no further once one method is told the best.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")]


@app.command("plan")
def plan_(
    file: File,
    out: Out = None,
    worlds: Worlds = "",
    world_path: WorldPaths = None,
    detect: Annotated[
        str, typer.Option(help="Say how many rounds and seeds find such a difference of E between methods: 20%.")
    ] = "",
    quiet: Quiet = False,
) -> None:
    """Say what a campaign would drive and what that costs: simulated hours, and hours of cores.

    Prices rest on the runs that stand in its folder already, and on a table elsewhere. Exit status: 2 if a scenario
    cannot be driven.

    Example:
        taskslam campaign plan paper --worlds builtin --detect 20%
    """
    from taskslam.benchmark.campaign.design import design_words, share_of
    from taskslam.benchmark.campaign.price import Prices
    from taskslam.benchmark.campaign.state import unfinished

    share = share_of(detect) if detect else None
    kept, folder = _planned(file, out, worlds, world_path or [], quiet)
    specs = kept.plan.specs
    prices = Prices(specs, folder, kept.campaign.resources)
    standard_output().print(_price_table(kept, prices))
    left = unfinished(specs, folder)
    core_h = sum(prices.of(spec).core_s for spec in left) / _HOUR
    say(f"{len(specs)} runs, of which {len(specs) - len(left)} are finished; to drive: {core_h:.1f} core hours")
    if share is not None:
        say(design_words(specs, folder, share))
    _say_what_was_not_driven(kept.plan.refused)
    raise typer.Exit(2 if kept.plan.refused else 0)


@app.command("run")
def run(
    file: File,
    out: Out = None,
    worlds: Worlds = "",
    world_path: WorldPaths = None,
    engine: EngineOption = EngineChoice.LOCAL,
    jobs: Jobs = None,
    sbatch: Submit = None,
    address: Address = "",
    cheapest_first: Cheapest = False,
    until_decided: UntilDecided = False,
    quiet: Quiet = False,
) -> None:
    """Drive a campaign. Start it again after a stop: it goes on.

    With --engine slurm, jobs are submitted, and this command ends; `taskslam campaign status` says how far they are,
    and `taskslam campaign collect` evaluates what is finished. Exit status as of `taskslam suite`.

    Examples:
        taskslam campaign run paper --worlds builtin --jobs 2

        taskslam campaign run my_campaign.yaml --until-decided

        taskslam campaign run my_campaign.yaml --engine slurm --sbatch=--partition=long --sbatch=--time=8:00:00

        taskslam campaign run my_campaign.yaml --engine ray --address ray://head:10001
    """
    from taskslam.benchmark.campaign.plan_file import write_plan

    kept, folder = _planned(file, out, worlds, world_path or [], quiet)
    write_plan(folder, kept.campaign, kept.plan)
    _drive(kept, folder, engine, jobs, sbatch or [], address, cheapest_first, until_decided, quiet)


@app.command("resume")
def resume(
    file: File,
    out: Out = None,
    engine: EngineOption = EngineChoice.LOCAL,
    jobs: Jobs = None,
    sbatch: Submit = None,
    address: Address = "",
    cheapest_first: Cheapest = False,
    until_decided: UntilDecided = False,
    quiet: Quiet = False,
) -> None:
    """Go on with a campaign as it was planned, whatever its file says by now.

    Example:
        taskslam campaign resume paper --jobs 2
    """
    kept, folder = _begun(file, out)
    _drive(kept, folder, engine, jobs, sbatch or [], address, cheapest_first, until_decided, quiet)


@app.command("status")
def status(file: File, out: Out = None) -> None:
    """Say how far a campaign is, whoever drives it and from wherever.

    Example:
        taskslam campaign status paper
    """
    from taskslam.benchmark.campaign.price import Prices
    from taskslam.benchmark.campaign.state import State, states_of, strangers

    kept, folder = _begun(file, out)
    states = states_of(kept.plan.specs, folder)
    counts = Counter(one.state for one in states)
    standard_output().print(_state_table(states))
    words = ", ".join(f"{counts[state]} {state}" for state in State if counts[state])
    say(f"{len(states)} runs in {folder}: {words}")
    prices = Prices(kept.plan.specs, folder, kept.campaign.resources)
    left_h = sum(prices.of(one.spec).core_s for one in states if one.state is not State.FINISHED) / _HOUR
    if left_h:
        say(f"Left to drive: {left_h:.1f} core hours")
    named = [one for one in states if one.note is not None]
    for one in named[:_MOST_NAMED]:
        assert one.note is not None
        where = f" (on {one.note.machine})" if one.note.machine else ""
        say(f"{one.note.title}: {one.note.ending}{where}: {one.note.detail}")
    if len(named) > _MOST_NAMED:
        say(f"and {len(named) - _MOST_NAMED} more; all are in {folder}/campaign/notes")
    _say_what_was_not_driven(kept.plan.refused)
    if others := strangers(kept.plan.specs, folder):
        say(f"{len(others)} finished runs there are not of this plan, the first {others[0]}")


@app.command("collect")
def collect(file: File, out: Out = None) -> None:
    """Evaluate what is finished: metrics.json and report.html in the folder. Needs nothing but that folder.

    Exit status: 0 every run is finished; 1 not all are.

    Example:
        taskslam campaign collect paper
    """
    from taskslam.benchmark.campaign.notes import keep
    from taskslam.benchmark.campaign.state import unfinished
    from taskslam.benchmark.engine import Ending, Result
    from taskslam.benchmark.sealing import forget_secret

    kept, folder = _begun(file, out)
    left = unfinished(kept.plan.specs, folder)
    for spec in set(kept.plan.specs) - set(left):
        keep(folder, Result(spec.title, Ending.KEPT, "", spec))
    if not left:
        forget_secret(folder)
    if len(left) < len(kept.plan.specs):
        _report(folder)
    say(f"{len(kept.plan.specs) - len(left)} of {len(kept.plan.specs)} runs are finished")
    raise typer.Exit(1 if left else 0)


@app.command("prune")
def prune(
    file: File,
    out: Out = None,
    strangers: Annotated[bool, typer.Option(help="Also finished runs that are not of this plan.")] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Remove; without it, they are only named.")] = False,
) -> None:
    """Remove what interrupted starts left of runs that are finished or no longer planned, and logs of ended jobs.

    Example:
        taskslam campaign prune paper --yes
    """
    from taskslam.benchmark.campaign import state
    from taskslam.benchmark.campaign.plan_file import campaign_folder
    from taskslam.files import remove, writing

    kept, folder = _begun(file, out)
    specs = kept.plan.specs
    doomed = state.leftovers(specs, folder)
    doomed += state.strangers(specs, folder) if strangers else []
    if not state.unfinished(specs, folder):
        doomed += sorted((campaign_folder(folder) / "slurm").glob("*"))
    for place in doomed:
        say(f"{'removed' if yes else 'would remove'} {place}")
        if yes:
            with writing(place):
                remove(place)
    say(f"{len(doomed)} places{'' if yes or not doomed else '; --yes removes them'}")


@app.command("compress")
def compress(
    folder: Annotated[Path, typer.Argument(help="Of a campaign, or any with runs.")],
    undo: Annotated[bool, typer.Option("--undo", help="Bring the plain files back.")] = False,
) -> None:
    """Compress the trajectories of finished tours: a third of the room, and nothing lost.

    truth.tum becomes truth.tum.gz, which every verb reads as before; gunzip, or --undo, brings it back. Replays stay
    as they are, since tools for trajectories are given their files. More can be driven into the folder meanwhile.

    Examples:
        taskslam campaign compress paper

        taskslam campaign compress paper --undo
    """
    from taskslam.errors import RecordError
    from taskslam.record import find_runs, load_manifest
    from taskslam.record.compression import compress_trajectories, expand_trajectories

    freed, count = 0, 0
    for run in find_runs(folder):
        try:
            if load_manifest(run).source == "simulation":
                freed += (expand_trajectories if undo else compress_trajectories)(run)
                count += 1
        except RecordError as error:
            say(f"left as it is: {error}", err=True)
    say(f"{count} runs; {abs(freed) / 1e6:.1f} MB of the disk are {'free' if freed >= 0 else 'taken'} by that")


@app.command("tables")
def tables(
    folder: Annotated[Path, typer.Argument(help="Of a campaign, or any with runs.")],
    into: Annotated[
        Path | None, typer.Option(help="A Markdown file, in which they take the place of what is between their marks.")
    ] = None,
) -> None:
    """Print the results of what is finished as Markdown, a table for each place, and what is left with its price.

    --into puts them into a page between the lines `<!-- tables of NAME -->` and `<!-- end of tables of NAME -->`, where
    NAME is that of the campaign, or of the folder; the same runs give the same page.

    Examples:
        taskslam campaign tables paper

        taskslam campaign tables paper --into docs/results.md
    """
    from taskslam.benchmark.campaign.plan_file import has_plan, read_plan
    from taskslam.report.results import read_results
    from taskslam.report.tables.markdown import methods_markdown
    from taskslam.report.tables.marked_part import replace_marked

    results = read_results([folder])
    kept = read_plan(folder) if has_plan(folder) else None
    text = methods_markdown(results, under_way=kept is not None) if results.runs else "No run is finished.\n"
    text += f"\n{_left_in_words(kept, folder)}\n" if kept is not None else ""
    if into is None:
        say(text.rstrip())
    else:
        replace_marked(into, folder.absolute().name if kept is None else kept.campaign.name, text)
        say(str(into))


def drive_planned(planned: Plan, engine: Engine, out: Path, sealed: bool, quiet: bool) -> None:
    """Let an engine drive a plan, name what was not driven, and leave a report; ends with the exit status."""
    from taskslam.benchmark.campaign.notes import Keeping
    from taskslam.benchmark.campaign.state import unfinished
    from taskslam.benchmark.engine import DRIVEN, Ending
    from taskslam.benchmark.sealing import sealed as sealed_with
    from taskslam.cli.progress import suite_progress

    try:
        with (
            suite_progress(quiet, len(planned.specs)) as watcher,
            sealed_with(out, sealed) as seal,
            closing(engine.run(planned.specs, out, Keeping(out, watcher))) as ran,  # type: ignore[type-var]
        ):
            results = [*planned.refused, *ran]
            seal.keep = any(result.ending in {Ending.FAILED, Ending.SUBMITTED} for result in results)
    except StoppedError as stop:
        done = len(planned.specs) - len(unfinished(planned.specs, out))
        stop.add_note(f"{done} of {len(planned.specs)} runs are finished and kept; start again to go on")
        raise
    _say_what_was_not_driven(results)
    endings = {result.ending for result in results}
    if Ending.SUBMITTED in endings:
        count = sum(result.ending is Ending.SUBMITTED for result in results)
        say(f"{count} runs are submitted; see `taskslam campaign status {out}`")
    elif endings & DRIVEN:
        _report(out)
    raise typer.Exit(3 if Ending.FAILED in endings else 2 if Ending.REFUSED in endings else 0)


def _drive(
    kept: KeptPlan,
    out: Path,
    choice: EngineChoice,
    jobs: int | None,
    sbatch: list[str],
    address: str,
    cheapest_first: bool,
    until_decided: bool,
    quiet: bool,
) -> None:
    from taskslam.benchmark.campaign.planning import Plan
    from taskslam.benchmark.campaign.price import Prices
    from taskslam.benchmark.engines.until_decided import UntilDecided, check_comparable
    from taskslam.errors import InputError

    campaign, plan = kept.campaign, kept.plan
    if cheapest_first:
        specs = tuple(Prices(plan.specs, out, campaign.resources).cheapest_first(plan.specs))
        plan = Plan(specs, plan.refused, plan.folders)
    engine = _engine(kept, choice, jobs, sbatch, address)
    if until_decided:
        if choice is EngineChoice.SLURM:
            raise InputError("--until-decided needs results as they come; expected --engine local or ray")
        check_comparable(plan.specs)
        engine = UntilDecided(engine, say)
    drive_planned(plan, engine, out, campaign.sealed, quiet)


def _engine(kept: KeptPlan, choice: EngineChoice, jobs: int | None, sbatch: list[str], address: str) -> Engine:
    import os

    from taskslam.benchmark.engines.local import LocalEngine
    from taskslam.benchmark.engines.ray import RayEngine
    from taskslam.benchmark.engines.slurm import SlurmEngine

    folders, resources = kept.plan.folders, kept.campaign.resources
    if choice is EngineChoice.SLURM:
        return SlurmEngine(folders, resources, tuple(sbatch))
    if choice is EngineChoice.RAY:
        return RayEngine(address, jobs, folders, resources)
    return LocalEngine(jobs or len(os.sched_getaffinity(0)), folders, resources)


def _planned(file: str, out: Path | None, worlds: str, world_paths: list[Path], quiet: bool) -> tuple[KeptPlan, Path]:
    """A campaign planned from its file, and the folder of its results; of a folder, as it was planned."""
    from taskslam.benchmark.campaign.campaign_file import load_campaign
    from taskslam.benchmark.campaign.plan_file import KeptPlan, has_plan
    from taskslam.benchmark.campaign.planning import plan
    from taskslam.cli.progress import progress

    if has_plan(Path(file)):
        return _begun(file, out)
    campaign = load_campaign(file)
    with progress(quiet) as observer:
        planned = plan(campaign, words_of(worlds), world_paths, observer)
    return KeptPlan(campaign, planned), out or Path(campaign.name)


def _begun(file: str, out: Path | None) -> tuple[KeptPlan, Path]:
    """The campaign of a folder, or of the folder that a file's campaign has by default."""
    from taskslam.benchmark.campaign.campaign_file import load_campaign
    from taskslam.benchmark.campaign.plan_file import has_plan, read_plan

    folder = out or (Path(file) if has_plan(Path(file)) else Path(load_campaign(file).name))
    return read_plan(folder), folder


def _report(out: Path) -> None:
    from taskslam.evaluation import evaluate_runs, write_metrics
    from taskslam.report import write_report

    write_metrics(out, evaluate_runs([out]))
    say(f"Report: {write_report([out], out / 'report.html')}")


def _left_in_words(kept: KeptPlan, folder: Path) -> str:
    """How much of a campaign is driven, and what is left of each method, with its price."""
    from taskslam.benchmark.campaign.price import Prices
    from taskslam.benchmark.campaign.state import unfinished

    specs = kept.plan.specs
    left = unfinished(specs, folder)
    driven = f"Of the campaign `{kept.campaign.name}`, {len(specs) - len(left)} of {len(specs)} runs are driven."
    if not left:
        return driven
    prices = Prices(specs, folder, kept.campaign.resources)
    parts = []
    for way in dict.fromkeys(spec.way for spec in left):
        own = [spec for spec in left if spec.way == way]
        hours = sum(prices.of(spec).core_s for spec in own) / _HOUR
        parts.append(f"`{way}` {len(own)} runs, {hours:.1f} h")
    return f"{driven} Left, with the price in hours of one core: {'; '.join(parts)}."


def _say_what_was_not_driven(results: Sequence[Result]) -> None:
    from taskslam.benchmark.campaign.notes import NOT_DRIVEN

    for result in results:
        if result.ending in NOT_DRIVEN:
            say(f"{result.title}: {result.ending}: {result.detail}", err=True)


def _price_table(kept: KeptPlan, prices: Prices) -> Table:
    """Runs, simulated hours and core hours by method."""
    from rich.table import Table

    table = Table(title=f"campaign {kept.campaign.name}", title_justify="left")
    table.add_column("method")
    for heading in ("runs", "simulated h", "core h", "measured here"):
        table.add_column(heading, justify="right")
    groups: dict[str, list[Price]] = {}
    for spec in kept.plan.specs:
        groups.setdefault(spec.way, []).append(prices.of(spec))
    groups["all"] = [price for group in groups.values() for price in group]
    for way, found in groups.items():
        simulated = sum(price.simulated_s for price in found) / _HOUR
        core = sum(price.core_s for price in found) / _HOUR
        measured = sum(price.measured for price in found)
        table.add_row(way, str(len(found)), f"{simulated:.1f}", f"{core:.1f}", str(measured or "–"))
    return table


def _state_table(states: Sequence[RunState]) -> Table:
    """Finished runs of all, by method and scenario."""
    from rich.table import Table

    from taskslam.benchmark.campaign.state import State

    total: Counter[tuple[str, str]] = Counter()
    done: Counter[tuple[str, str]] = Counter()
    for one in states:
        total[one.spec.way, one.spec.task.name] += 1
        done[one.spec.way, one.spec.task.name] += one.state is State.FINISHED
    scenarios = list(dict.fromkeys(name for _, name in total))
    table = Table()
    table.add_column("finished")
    for name in scenarios:
        table.add_column(name, justify="right")
    for way in dict.fromkeys(way for way, _ in total):
        cells = [f"{done[way, name]}/{total[way, name]}" if (way, name) in total else "–" for name in scenarios]
        table.add_row(way, *cells)
    return table


def words_of(text: str) -> list[str]:
    """`a, b` as two words."""
    return [word.strip() for word in text.split(",") if word.strip()]
