"""`taskslam replay`: feed a recorded dataset to a SLAM method, open loop."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from taskslam.cli.console import say
from taskslam.cli.options import parse_options
from taskslam.cli.run import LatencyChoice
from taskslam.mode import Mode


def replay(
    dataset: Annotated[Path, typer.Argument(help="An EuRoC/ASL folder, a ROS 1 bag, a ROS 2 bag or an MCAP.")],
    method: Annotated[list[str], typer.Option("--method", "-m", help="A registered SLAM method; may be repeated.")],
    rounds: Annotated[int, typer.Option(min=1, help="Rounds that count.")] = 1,
    mode: Annotated[Mode, typer.Option(help="With map: a priming round first.")] = Mode.WITHOUT_MAP,
    option: Annotated[
        list[str] | None, typer.Option("--option", help="An option of the method: do_loop_closing=false.")
    ] = None,
    latency: Annotated[LatencyChoice, typer.Option(help="Of the method's estimates.")] = LatencyChoice.FIXED,
    cpu_scale: Annotated[float, typer.Option(help="Times slower than this machine, for measured latency.")] = 1.0,
    robot: Annotated[
        str | None, typer.Option(help="Robot preset or YAML file, for a recording that does not tell its rig.")
    ] = None,
    topic: Annotated[
        list[str] | None, typer.Option(help="A bag's topic: wheel_odometry=/odom; may be repeated.")
    ] = None,
    base_frame: Annotated[
        str | None, typer.Option(help="The base's frame in a bag; default base_footprint or base_link.")
    ] = None,
    mount: Annotated[
        list[str] | None, typer.Option(help="Where a bag's frame sits in the base: laser=x,y,z,roll,pitch,yaw.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for run directories.")] = Path("replays"),
    overwrite: Annotated[bool, typer.Option(help="Replay again what is finished already.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Feed a recording to a SLAM method and record the poses that it gives live.

    `taskslam evaluate-trajectories` judges them. Exit status: 0 every round came to the recording's end; 1 a method
    failed; 2 wrong input; 3 infrastructure.

    Examples:
        taskslam replay MH_01_easy -m orb_slam3 --rounds 5

        taskslam replay house.mcap -m karto -m hector --mode with-map

        taskslam replay robot.bag -m karto --topic wheel_odometry=/odom --mount laser=0.1,0,0.2,0,0,0
    """
    from taskslam.benchmark.replay import replay as feed
    from taskslam.benchmark.spec import spec_of_replay
    from taskslam.cli.progress import progress
    from taskslam.datasets.opening import open_dataset
    from taskslam.robot import load_robot
    from taskslam.slam.cards import card_of
    from taskslam.slam.guest.latency import LatencyMode, LatencyModel

    options = parse_options(option or [])
    rig = load_robot(robot) if robot else None
    for name in method:
        card_of(name)
    complete = True
    with (
        progress(quiet) as observer,
        open_dataset(dataset, rig, _pairs("--topic", topic), base_frame, _pairs("--mount", mount)) as recording,
    ):
        for note in recording.notes:
            observer.notice(note)
        for name in method:
            model = LatencyModel(LatencyMode(latency.value), cpu_scale)
            spec = spec_of_replay(recording, name, mode, rounds, options, model)
            observer.run_begins(spec.title)
            directory, came_to_the_end = feed(recording, spec, out, observer, overwrite)
            complete = complete and came_to_the_end
            if not quiet:
                say(f"Replay: {directory}")
        for sentence in recording.skipped.sentences():
            observer.notice(f"left out: {sentence}")
    raise typer.Exit(0 if complete else 1)


def _pairs(flag: str, values: list[str] | None) -> dict[str, str]:
    from taskslam.errors import InputError

    pairs = {}
    for value in values or []:
        key, equals, rest = value.partition("=")
        if not (key and equals and rest):
            raise InputError(f"{flag} {value}: expected NAME=VALUE")
        pairs[key] = rest
    return pairs
