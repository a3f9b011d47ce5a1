"""`taskslam ros`: node files, with which anybody's ROS node is driven as a method (`-m ros:NODE.yaml`)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from taskslam.cli.console import say, standard_output

app = typer.Typer(no_args_is_help=True, help="Node files: anybody's ROS node as a method, `-m ros:NODE.yaml`.")


@app.command("list")
def list_nodes() -> None:
    """List the node files that ship.

    Example: `taskslam ros list`, then `taskslam ros show hector`
    """
    from rich.table import Table

    from taskslam.ros.node_file import NODES, load_node

    table = Table(box=None, header_style="bold", padding=(0, 2, 0, 0))
    for column in ("node", "ros", "sensors", "summary"):
        table.add_column(column, no_wrap=column != "summary")
    for name in NODES.names():
        node = load_node(name)
        table.add_row(name, str(node.ros), "\n".join(node.sensors), node.summary)
    standard_output().print(table)


@app.command("show")
def show(name: Annotated[str, typer.Argument(help="A node file that ships.")]) -> None:
    """Print a node file that ships, to begin your own from."""
    from taskslam.ros.node_file import NODES

    say(NODES.text(name)[0].rstrip())


@app.command("check")
def check(
    node: Annotated[str, typer.Argument(help="A node file, or the name of one that ships.")],
    robot: Annotated[
        str, typer.Option(help="Robot preset or YAML file: it says which sensors there are.")
    ] = "turtlebot2",
) -> None:
    """Start a node, connect, give it ten frames, and say in words what is missing.

    Exit status: 0 it answered; 1 it did not, or it failed; 2 the file is wrong, or the node does not start and connect.

    Example:
        taskslam ros check my_slam.yaml --robot turtlebot2_d435i
    """
    from statistics import median

    from rich.text import Text

    from taskslam.benchmark.conformance_eyes import conformance_looks
    from taskslam.robot import load_robot
    from taskslam.ros.check import check_node

    found = check_node(node, load_robot(robot).rig, conformance_looks)
    console = standard_output()
    for finding in found.findings:
        console.print(Text.assemble(("note    ", "yellow"), finding), soft_wrap=True)
    if found.failure:
        console.print(Text.assemble(("failed  ", "bold red"), found.failure), soft_wrap=True)
    verdict = ("passed  ", "green") if found.passed else ("failed  ", "bold red")
    took = f", {median(found.wall_ms):.1f} ms each" if found.wall_ms else ""
    console.print(Text.assemble(verdict, f"{found.poses} of {found.frames} frames answered{took}"))
    if not found.passed:
        raise typer.Exit(1)


@app.command("messages")
def messages(
    folder: Annotated[Path, typer.Argument(help="A new folder, which stays: the types are read from it.")],
) -> None:
    """Make the message types that the wheels of ROS 2 lack: tf2_msgs for /tf, and Nav2's NavigateToPose.

    Whoever has a ROS 2 has them. With wheels alone, name the script that is left wherever a setup is asked for.

    Example: `taskslam ros messages ros2`, then `taskslam serve house --ros 2 --setup ros2/setup.bash`
    """
    from taskslam.ros.ros2.messages import make_messages

    say(f"Setup: {make_messages(folder)}")


@app.command("goals")
def goals(
    out: Annotated[Path, typer.Argument(help="A new YAML file, for waypoints_file of a scenario.")],
    ros: Annotated[int, typer.Option(min=1, max=2, help="The version of ROS.")] = 2,
    join: Annotated[str, typer.Option(help="The graph: a roscore's URI, or the number of a domain.")] = "",
    setup: Annotated[str, typer.Option(help="A script of your ROS 2, whose Python then runs our bridge.")] = "",
    topic: Annotated[str, typer.Option(help="Default: where RViz gives goals.")] = "",
    count: Annotated[int | None, typer.Option(min=1, help="End after so many; default: by Ctrl-C.")] = None,
) -> None:
    """Collect the goals that you give in RViz (2D Goal Pose) as waypoints.

    Example: `taskslam ros goals goals.yaml`, then `sequence: {waypoints_file: goals.yaml}` in a scenario
    """
    from contextlib import closing

    from taskslam.ros.goals import TOPICS, collect_goals
    from taskslam.ros.opening import join_graph

    with closing(join_graph(ros, "/taskslam_goals", join, setup or None)) as transport:
        found = collect_goals(transport, topic or TOPICS[ros], out, count, say)
    say(f"{found} waypoints: {out}" if found else "no goals were given: nothing was written")
