"""`taskslam run` and `taskslam demo`: drive tours, then say how repeatable, accurate and complete they were."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from taskslam.cli.console import say
from taskslam.cli.options import WorldPath, parse_options
from taskslam.mode import Mode

if TYPE_CHECKING:
    from taskslam.benchmark.platform import Platform
    from taskslam.benchmark.run import Driver
    from taskslam.benchmark.stage import Stage
    from taskslam.observer import Observer
    from taskslam.ros.connection import Connection
    from taskslam.ros.transport import Transport
    from taskslam.slam.base import MethodCard


class ModeChoice(StrEnum):
    """Which modes to drive."""

    WITHOUT_MAP = Mode.WITHOUT_MAP.value
    WITH_MAP = Mode.WITH_MAP.value
    BOTH = "both"


class PlatformChoice(StrEnum):
    """What drives."""

    SIMULATOR = "simulator"
    ROS1 = "ros1"
    ROS2 = "ros2"


class DriveChoice(StrEnum):
    """Whose navigation, and whose SLAM, drive."""

    OURS = "ours"
    NAV2 = "nav2"
    MOVE_BASE = "move_base"


class LatencyChoice(StrEnum):
    """How a method's estimates are delayed."""

    FIXED = "fixed"
    MEASURED = "measured"
    ZERO = "zero"


def run(
    scenario: Annotated[str, typer.Argument(help="A shipped scenario (house, aws_small_house, ...) or a YAML file.")],
    method: Annotated[
        list[str] | None, typer.Option("--method", "-m", help="A registered SLAM method; may be repeated.")
    ] = None,
    mode: Annotated[ModeChoice, typer.Option(help="Without map, with map, or both.")] = ModeChoice.BOTH,
    rounds: Annotated[int | None, typer.Option(min=1, help="Rounds that count; default: the scenario's.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of every random source.")] = 0,
    latency: Annotated[LatencyChoice, typer.Option(help="Of the method's estimates.")] = LatencyChoice.FIXED,
    cpu_scale: Annotated[float, typer.Option(help="Times slower than this machine, for measured latency.")] = 1.0,
    out: Annotated[Path, typer.Option(help="Folder for run directories and report.")] = Path("results"),
    world_path: WorldPath = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="Override a scenario key: protocol.pause=2; may be repeated.")
    ] = None,
    option: Annotated[
        list[str] | None, typer.Option("--option", help="An option of the method: do_loop_closing=false.")
    ] = None,
    sealed: Annotated[
        bool, typer.Option("--sealed", help="Noise that a method cannot guess; run.json then says how to repeat it.")
    ] = False,
    salt: Annotated[str, typer.Option(help="Repeat a sealed run: the salt that its run.json holds.")] = "",
    platform: Annotated[
        PlatformChoice, typer.Option(help="Our simulator, or a robot that answers over ROS.")
    ] = PlatformChoice.SIMULATOR,
    connection: Annotated[
        Path | None, typer.Option(help="A robot's topics, frames, limits and stop button: a YAML file.")
    ] = None,
    drive: Annotated[
        DriveChoice, typer.Option(help="Our navigator with a method, or the robot's own Nav2 (ros2), move_base (ros1).")
    ] = DriveChoice.OURS,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Look at the robot, and drive nothing.")] = False,
    overwrite: Annotated[bool, typer.Option(help="Drive again what is finished already.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no tables.")] = False,
) -> None:
    """Drive a tour under a SLAM method and measure its repeatability.

    Exit status: 0 every goal of every round was reached; 1 not all were; 2 wrong input; 3 infrastructure.

    Examples:
        taskslam run house --method karto

        taskslam run aws_small_house -m karto -m wheel_odometry --world-path ~/aws-robomaker-small-house-world

        taskslam run my_tour.yaml -m karto --mode with-map --set protocol.pause=2 --latency measured --cpu-scale 4

        taskslam run house -m karto --mode with-map --rounds 2 --sealed

        taskslam run my_tour.yaml -m karto --platform ros1 --connection my_robot.yaml

        taskslam run my_tour.yaml --drive nav2 --platform ros2 --mode with-map
    """
    from taskslam.benchmark.sealing import checked_salt
    from taskslam.benchmark.sealing import sealed as seal
    from taskslam.errors import InputError
    from taskslam.slam.guest.latency import LatencyMode, LatencyModel

    overrides = list(set_ or [])
    if rounds is not None:
        overrides.append(f"protocol.rounds={rounds}")
    options, delay = parse_options(option or []), LatencyModel(LatencyMode(latency.value), cpu_scale)
    is_sealed = sealed or bool(salt)
    robot = None
    if platform is not PlatformChoice.SIMULATOR:
        robot = _Robot(int(platform.value[-1]), connection, dry_run, drive is not DriveChoice.OURS)
    methods = _driven_methods(drive, method or [], robot)
    ways = [(name, chosen, seed, options, delay, is_sealed) for name in methods for chosen in _modes(mode)]
    if salt and len(ways) != 1:
        raise InputError(f"--salt repeats one run; expected one method and one mode, not {len(ways)} runs")
    if robot is None and (connection or dry_run):
        raise InputError("--connection and --dry-run are for a robot: expected --platform ros1 or ros2 too")
    if robot is not None and is_sealed:
        raise InputError("--sealed and --salt are for the simulator: a robot has no dice")
    with seal(out, sealed and not salt):
        given = checked_salt(salt) if salt else None
        complete = _drive(scenario, overrides, ways, out, world_path or [], overwrite, quiet, given, robot)
    if dry_run:
        raise typer.Exit(0)
    _conclude(out, quiet)
    raise typer.Exit(0 if complete else 1)


def demo(
    out: Annotated[Path, typer.Option(help="Folder for run directories and report.")] = Path("demo"),
    rounds: Annotated[int, typer.Option(min=1, help="Rounds that count.")] = 5,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no tables.")] = False,
) -> None:
    """Drive the main job on the built-in house: Karto in both modes, wheel odometry for comparison; ends in a report.

    Example:
        taskslam demo --out demo
    """
    ways = [("karto", Mode.WITHOUT_MAP), ("karto", Mode.WITH_MAP), ("wheel_odometry", Mode.WITHOUT_MAP)]
    _drive("house", [f"protocol.rounds={rounds}"], ways, out, [], False, quiet)
    _conclude(out, quiet)


def _modes(choice: ModeChoice) -> list[Mode]:
    return list(Mode) if choice is ModeChoice.BOTH else [Mode(choice)]


@dataclass(frozen=True)
class _Robot:
    """A robot that answers over ROS, of this version. dry: it is only looked at; itself: its own navigation drives."""

    ros: int
    connection: Path | None
    dry: bool
    itself: bool = False

    def described(self) -> Connection:
        """What its connection's file says. Raises InputError."""
        from taskslam.ros.connection import Connection, load_connection

        return load_connection(self.connection) if self.connection else Connection()


def _driven_methods(drive: DriveChoice, methods: list[str], robot: _Robot | None) -> list[str]:
    """The methods to be driven; a robot's own SLAM goes by the name of its stack. Raises InputError."""
    from taskslam.benchmark.robot_tour import stack_name
    from taskslam.errors import InputError

    if drive is DriveChoice.OURS:
        if not methods:
            raise InputError("which method? Expected --method, as -m karto; taskslam methods list names them")
        return methods
    ros = 2 if drive is DriveChoice.NAV2 else 1
    if methods:
        raise InputError(f"--drive {drive}: the robot's own SLAM steers it; expected no --method")
    if robot is None or robot.ros != ros:
        raise InputError(f"--drive {drive}: it answers over ROS {ros}; expected --platform ros{ros}")
    return [stack_name(ros, robot.described())]


def _drive(
    scenario: str,
    overrides: list[str],
    ways: Sequence[tuple[Any, ...]],
    out: Path,
    world_paths: list[Path],
    overwrite: bool,
    quiet: bool,
    salt: str | None = None,
    robot: _Robot | None = None,
) -> bool:
    from taskslam.benchmark.run import run as drive
    from taskslam.benchmark.stage import set_stage
    from taskslam.cli.progress import progress
    from taskslam.scenario import load_scenario
    from taskslam.slam.cards import card_of

    loaded = load_scenario(scenario, overrides)
    for name, *_ in ways if robot is None or not robot.itself else ():
        card_of(name)
    all_complete = True
    with progress(quiet) as observer:
        stage = set_stage(loaded, world_paths, observer)
        for warning in stage.world.warnings if stage.world is not None else ():
            observer.notice(warning)
        platform = driver = None
        if robot is not None:
            stage, platform, driver = _on_robot(stage, robot, observer)
        for way in ways:
            spec = stage.spec(*way)
            observer.run_begins(spec.title)
            if robot is not None and robot.dry:
                assert platform is not None
                with platform(driver.card if driver else card_of(spec.method)):
                    say(f"{spec.title}: the robot is ready")
                continue
            _, complete = drive(stage, spec, out, observer, overwrite, salt=salt, platform=platform, driver=driver)
            all_complete = all_complete and complete
    return all_complete


def _on_robot(
    stage: Stage, robot: _Robot, observer: Observer
) -> tuple[Stage, Callable[[MethodCard], Platform], Driver | None]:
    """The stage without a simulator, who makes the robot, and who drives it where that is not we."""
    from taskslam.benchmark.robot_tour import on_robot, robot_for, stack_for
    from taskslam.ros.opening import join_graph

    connection, stage = robot.described(), on_robot(stage)

    def connect() -> Transport:
        return join_graph(robot.ros, "/taskslam_tour", connection.graph, connection.setup)

    if robot.itself:
        return stage, *stack_for(stage, robot.ros, connect, connection, observer)
    return stage, robot_for(stage, connect, connection, observer), None


def _conclude(out: Path, quiet: bool) -> None:
    """Evaluate what stands in the folder, and write its report."""
    from taskslam.cli.evaluate import evaluate
    from taskslam.evaluation import evaluate_runs, write_metrics
    from taskslam.report import write_report

    if quiet:
        write_metrics(out, evaluate_runs([out]))
    else:
        evaluate(out)
    page = write_report([out], out / "report.html")
    if not quiet:
        say(f"Report: {page}")
