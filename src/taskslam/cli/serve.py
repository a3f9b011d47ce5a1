"""`taskslam serve`: the simulator as a robot in somebody's ROS graph."""

from __future__ import annotations

from contextlib import closing
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from taskslam.cli.console import say
from taskslam.cli.options import WorldPath


class RosChoice(StrEnum):
    """Versions of ROS."""

    ONE = "1"
    TWO = "2"


def serve(
    scenario: Annotated[str, typer.Argument(help="A shipped scenario (house, aws_small_house, ...) or a YAML file.")],
    ros: Annotated[RosChoice, typer.Option(help="The version of ROS.")] = RosChoice.ONE,
    out: Annotated[Path, typer.Option(help="New folder for the record, true poses among it.")] = Path("served"),
    join: Annotated[
        str,
        typer.Option(
            help="A graph to join: a roscore's URI, or the number of a domain. Default: one of our own, named."
        ),
    ] = "",
    setup: Annotated[str, typer.Option(help="A script of your ROS 2, whose Python then runs our bridge.")] = "",
    real_time_factor: Annotated[
        float | None, typer.Option(min=0.01, max=1000, help="Times real time; default: in step with /cmd_vel.")
    ] = None,
    period: Annotated[
        float, typer.Option(help="Simulated seconds from one turn of the other side to the next.")
    ] = 0.05,
    wait: Annotated[
        float, typer.Option(min=0.1, help="In step: longest wait for the next command while under way, s.")
    ] = 10.0,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="End after so many simulated seconds.")] = None,
    publish_truth: Annotated[
        bool, typer.Option("--publish-truth", help="The true pose on /ground_truth/odom too; the record says so.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of every random source.")] = 0,
    robot: Annotated[str | None, typer.Option(help="A robot preset or YAML file; default: the scenario's.")] = None,
    world_path: WorldPath = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="Override a scenario key: start.x=2; may be repeated.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Serve the simulated robot in ROS: /clock, /tf, /odom, /scan, /imu, clouds, images, /bumper and /map; /cmd_vel in.

    Time goes on by a control period as soon as a command has come, so that nobody is too slow; where nobody commands,
    in real time. It ends by INT (Ctrl-C) or after --seconds, the robot at zero speed. Exit status: 0 it was served;
    2 wrong input; 3 infrastructure.

    Examples:
        taskslam serve house --out served

        taskslam serve house --real-time-factor 2 --join http://localhost:11311 --publish-truth

        taskslam serve house --ros 2 --join 0 --setup /opt/ros/jazzy/setup.bash
    """
    from taskslam.benchmark.serve import ServeSettings
    from taskslam.benchmark.serve import serve as run
    from taskslam.benchmark.stage import set_stage
    from taskslam.cli.progress import progress
    from taskslam.ros.opening import join_graph, open_graph_of_our_own
    from taskslam.scenario import load_scenario

    overrides = [*(set_ or []), *([f"robot={robot}"] if robot else [])]
    version = int(ros.value)
    settings = ServeSettings(version, seed, period, real_time_factor, wait, seconds, publish_truth)
    with progress(quiet) as observer:
        stage = set_stage(load_scenario(scenario, overrides), world_path or [], observer)
        name, script = "/taskslam_robot", setup or None
        graph = join_graph(version, name, join, script) if join else open_graph_of_our_own(version, name, script)
        with closing(graph) as transport:
            observer.run_begins(f"{stage.scenario.name} · served over ROS {version}")
            for variable, value in transport.variables.items():
                observer.notice(f"export {variable}={value}")
            served = run(stage, transport, settings, out, observer)
    if not quiet:
        say(f"Served {served.simulated_s:.1f} s of simulated time; the true poses are in {out}")
