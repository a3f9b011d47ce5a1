"""`taskslam suite`: a campaign on this machine in one command, resumed where it stopped, ending in one report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from taskslam.cli.options import WorldPaths
from taskslam.mode import Mode


def suite(
    name: Annotated[str, typer.Argument(help="A shipped campaign (paper) or a YAML file.")],
    worlds: Annotated[
        str, typer.Option(help="Its worlds, as builtin or aws (clone them first); default: its first.")
    ] = "",
    methods: Annotated[str, typer.Option(help="Comma-separated; default: the suite's.")] = "",
    modes: Annotated[str, typer.Option(help=f"Comma-separated: {', '.join(Mode)}; default: the suite's.")] = "",
    seeds: Annotated[str, typer.Option(help="Comma-separated; default: the suite's, three.")] = "",
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
    world_path: WorldPaths = None,
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
    from taskslam.benchmark.campaign.campaign_file import load_campaign
    from taskslam.benchmark.campaign.plan_file import write_plan
    from taskslam.benchmark.campaign.planning import plan
    from taskslam.benchmark.engines.local import LocalEngine
    from taskslam.cli.campaign import drive_planned, words_of
    from taskslam.cli.progress import progress

    campaign = load_campaign(name)
    asked = {
        "methods": tuple(words_of(methods)),
        "modes": tuple(_mode(word) for word in words_of(modes)),
        "seeds": _numbers(seeds),
        "rounds": rounds,
        "latencies": tuple(words_of(latencies)),
        "settings": (*campaign.settings, *(set_ or ())),
        "sealed": sealed or campaign.sealed,
    }
    campaign = campaign.model_copy(update={key: value for key, value in asked.items() if value})
    with progress(quiet) as observer:
        sets = words_of(worlds) or list(campaign.scenarios)[:1] * isinstance(campaign.scenarios, dict)
        planned = plan(campaign, sets, world_path or (), observer)
    write_plan(out, campaign, planned)
    engine = LocalEngine(jobs, planned.folders, campaign.resources)
    drive_planned(planned, engine, out, campaign.sealed, quiet)


def _mode(word: str) -> Mode:
    from taskslam.errors import InputError

    if word not in list(Mode):
        raise InputError(f"--modes {word}: expected {' or '.join(Mode)}")
    return Mode(word)


def _numbers(text: str) -> tuple[int, ...]:
    from taskslam.cli.campaign import words_of
    from taskslam.errors import InputError

    words = words_of(text)
    if not all(word.isdecimal() for word in words):
        raise InputError(f"--seeds {text}: expected whole numbers, as in 0,1,2")
    return tuple(int(word) for word in words)
