"""`taskslam export`: drive a scenario in the simulator and write what the sensors said as a dataset."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import say
from taskslam.cli.options import WorldPath, parse_options

if TYPE_CHECKING:
    from taskslam.measurements import Sensor


class FormatChoice(StrEnum):
    """What is written."""

    EUROC = "euroc"
    ROSBAG1 = "rosbag1"
    ROSBAG2 = "rosbag2"
    MCAP = "mcap"


def export(
    scenario: Annotated[str, typer.Argument(help="A shipped scenario (house, aws_small_house, ...) or a YAML file.")],
    out: Annotated[Path, typer.Option(help="New folder for the dataset.")],
    format_: Annotated[FormatChoice, typer.Option("--format", help="EuRoC/ASL folder, ROS 1 or 2 bag, or MCAP.")],
    method: Annotated[str, typer.Option("--method", "-m", help="The method that steers.")] = "ground_truth",
    sensors: Annotated[
        str,
        typer.Option(help="As the robot names them: stereo,imu,odometry. Default: all that robot and format have."),
    ] = "",
    goals: Annotated[int | None, typer.Option(min=1, help="Drive to the first so many goals only.")] = None,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="Stop after so many simulated seconds.")] = None,
    robot: Annotated[str | None, typer.Option(help="A robot preset or YAML file; default: the scenario's.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of every random source.")] = 0,
    world_path: WorldPath = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="Override a scenario key: protocol.pause=2; may be repeated.")
    ] = None,
    option: Annotated[list[str] | None, typer.Option("--option", help="An option of the method.")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Drive one round of a scenario and write what the sensors said as a dataset.

    Beside the dataset, in `drive/`, stands the run directory of the drive. Exit status: 0 every goal was reached, or
    the drive ended as --seconds says; 1 a goal was not reached; 2 wrong input; 3 infrastructure.

    Examples:
        taskslam export house --out house-euroc --format euroc --seconds 60

        taskslam export house --out house-bag --format mcap --sensors lidar_2d,odometry --goals 3
    """
    from taskslam.benchmark.export import ExportRequest, Format
    from taskslam.benchmark.export import export as drive
    from taskslam.benchmark.stage import set_stage
    from taskslam.cli.progress import progress
    from taskslam.scenario import load_scenario

    overrides = [*(set_ or []), *([f"robot={robot}"] if robot else [])]
    request = ExportRequest(
        Format(format_.value), _sensors(sensors), method, seed, goals, seconds, parse_options(option or [])
    )
    with progress(quiet) as observer:
        stage = set_stage(load_scenario(scenario, overrides), world_path or [], observer)
        observer.run_begins(f"{stage.scenario.name} · {method} · export")
        complete = drive(stage, request, out, observer)
    if not quiet:
        say(f"Dataset: {out}")
    raise typer.Exit(0 if complete or seconds is not None else 1)


def _sensors(text: str) -> frozenset[Sensor] | None:
    from taskslam.errors import InputError, did_you_mean
    from taskslam.sensors import sensor_kinds

    if not text:
        return None
    by_field = {kind.field: kind.sensor for kind in sensor_kinds() if kind.bag}
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in by_field:
            raise InputError(f"--sensors {name}: expected one of {', '.join(by_field)}.{did_you_mean(name, by_field)}")
    return frozenset(by_field[name] for name in names)
