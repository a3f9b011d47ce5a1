"""`taskslam suite`: many runs in one command, resumed where they stopped, ending in one report."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import say
from taskslam.mode import Mode
from taskslam.stopping import StoppedError

if TYPE_CHECKING:
    from taskslam.benchmark.engine import Result


def suite(
    name: Annotated[str, typer.Argument(help="A shipped suite (paper) or a YAML file.")],
    worlds: Annotated[str, typer.Option(help="Its worlds: builtin, or aws (clone them first).")] = "builtin",
    methods: Annotated[str, typer.Option(help="Comma-separated; default: the suite's.")] = "",
    modes: Annotated[str, typer.Option(help=f"Comma-separated: {', '.join(Mode)}.")] = ",".join(Mode),
    seeds: Annotated[str, typer.Option(help="Comma-separated.")] = "0",
    rounds: Annotated[int | None, typer.Option(min=1, help="Rounds that count; default: the suite's.")] = None,
    latencies: Annotated[
        str, typer.Option(help="Comma-separated: fixed, zero, measured x 4; default: the suite's.")
    ] = "",
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="Override a key of every scenario: protocol.pause=2; may be repeated."),
    ] = None,
    sealed: Annotated[
        bool, typer.Option("--sealed", help="Noise that a method cannot guess; each run.json says how to repeat it.")
    ] = False,
    jobs: Annotated[int, typer.Option("--jobs", "-j", min=1, help="Runs at a time, one process each.")] = 1,
    out: Annotated[Path, typer.Option(help="Folder for run directories and report.")] = Path("suite"),
    world_path: Annotated[
        list[Path] | None, typer.Option(help="Where your copies of the worlds lie; or TASKSLAM_WORLD_PATH.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Drive scenarios x methods x modes and compare them on one page. Start it again after a stop: it goes on.

    Exit status: 0 everything was driven (a method that fails its task is a result, not an error; one that is not
    installed is named); 2 wrong input, or a run was refused; 3 infrastructure: a run failed for reasons of this
    machine, or its process died. Stopped by a signal: 130, 143 or 129, and the rounds that had ended are kept.

    Examples:
        taskslam suite paper --jobs 2

        taskslam suite paper --worlds aws --world-path ~/worlds --methods karto,hector --modes without-map --rounds 3

        taskslam suite paper --methods karto,kiss_icp --latencies "measured,measured x 2,measured x 4"

        taskslam suite paper --methods orb_slam3 --set robot=turtlebot2_vga15 --out suite_vga15
    """
    from taskslam.benchmark.engine import Ending
    from taskslam.benchmark.engines.local import LocalEngine
    from taskslam.benchmark.sealing import sealed as sealed_with
    from taskslam.benchmark.spec import run_folder
    from taskslam.benchmark.suite import load_suite, plan
    from taskslam.cli.progress import progress, suite_progress
    from taskslam.evaluation import evaluate_runs, write_metrics
    from taskslam.record.run_directory import MANIFEST
    from taskslam.report import write_report

    chosen = [_mode(word) for word in _words(modes)]
    with progress(quiet) as observer:
        planned = plan(
            load_suite(name), worlds, _words(methods), chosen, _numbers(seeds), rounds, set_ or (), _words(latencies),
            sealed, world_path or [], observer,
        )  # fmt: skip
    engine = LocalEngine(jobs, planned.folders)
    try:
        with (
            suite_progress(quiet, len(planned.specs)) as watcher,
            sealed_with(out, sealed) as seal,
            closing(engine.run(planned.specs, out, watcher)) as ran,
        ):
            results = [*planned.refused, *ran]
            seal.keep = any(result.ending is Ending.FAILED for result in results)
    except StoppedError as stop:
        done = sum((run_folder(out, spec) / MANIFEST).exists() for spec in planned.specs)
        stop.add_note(f"{done} of {len(planned.specs)} runs are finished and kept; start again to go on")
        raise
    _say_what_was_not_driven(results)
    if any(result.ending in {Ending.COMPLETE, Ending.INCOMPLETE, Ending.KEPT} for result in results):
        write_metrics(out, evaluate_runs([out]))
        say(f"Report: {write_report([out], out / 'report.html')}")
    endings = {result.ending for result in results}
    raise typer.Exit(3 if Ending.FAILED in endings else 2 if Ending.REFUSED in endings else 0)


def _say_what_was_not_driven(results: list[Result]) -> None:
    from taskslam.benchmark.engine import Ending

    for result in results:
        if result.ending in {Ending.UNAVAILABLE, Ending.REFUSED, Ending.FAILED}:
            say(f"{result.title}: {result.ending}: {result.detail}", err=True)


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]


def _mode(word: str) -> Mode:
    from taskslam.errors import InputError

    if word not in list(Mode):
        raise InputError(f"--modes {word}: expected {' or '.join(Mode)}")
    return Mode(word)


def _numbers(text: str) -> list[int]:
    from taskslam.errors import InputError

    words = _words(text)
    if not words or not all(word.isdecimal() for word in words):
        raise InputError(f"--seeds {text}: expected whole numbers, as in 0,1,2")
    return [int(word) for word in words]
