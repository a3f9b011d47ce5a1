"""`taskslam methods`: which SLAM methods there are, what each declares, and whether it behaves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import standard_output
from taskslam.cli.options import parse_options

if TYPE_CHECKING:
    from taskslam.slam.base import MethodCard
    from taskslam.slam.conformance.check import CheckResult

app = typer.Typer(no_args_is_help=True, help="SLAM methods: list, show their cards, check that they behave.")

_STYLES = {"passed": "green", "failed": "bold red", "skipped": "dim"}


@app.command("list")
def list_methods() -> None:
    """List the registered methods, also those whose package is missing or broken."""
    from rich.table import Table
    from rich.text import Text

    from taskslam.slam.cards import inspect_methods

    table = Table(box=None, header_style="bold", padding=(0, 1, 0, 0))
    for column in ("method", "kind", "sensors", "licence", "map", "same", "ready"):
        table.add_column(column, no_wrap=column != "licence")
    broken = []
    for state in inspect_methods():
        if state.card is None:
            table.add_row(state.entry.name, "", "", "", "", "", Text("no", "red"))
        else:
            card = state.card
            table.add_row(
                state.entry.name,
                card.kind,
                "\n".join([*card.sensors, *(f"({sensor})" for sensor in card.optional_sensors)]),
                card.licence,
                card.map_mode,
                "yes" if card.deterministic else "no",
                Text("no", "yellow") if state.problem else "yes",
            )
        if state.problem:
            broken.append(f"{state.entry.name}: {state.problem}")
    console = standard_output()
    console.print(table)
    console.print("\nmap: what it does with its map in with-map rounds", style="dim")
    console.print("same: the same input gives the same bytes", style="dim")
    for line in broken:
        console.print(f"\n{line}", soft_wrap=True)


@app.command("show")
def show(name: Annotated[str, typer.Argument(help="A method's name, or package.module:Class.")]) -> None:
    """Show a method's card."""
    from rich.table import Table

    from taskslam.slam.cards import card_of, inspect_method

    state = inspect_method(name)
    card = state.card or card_of(name)
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(style="bold", no_wrap=True)
    for key, value in _card_rows(card):
        table.add_row(key, value)
    table.add_row("class", state.entry.target)
    table.add_row("available", state.problem if state.problem else "yes")
    standard_output().print(table)


@app.command("check")
def check(
    name: Annotated[str, typer.Argument(help="A method's name, or package.module:Class.")],
    option: Annotated[
        list[str] | None,
        typer.Option("--option", metavar="KEY=VALUE", help="An option of the method; may be repeated."),
    ] = None,
    robot: Annotated[
        str, typer.Option(help="Robot preset or YAML file: it says which sensors there are.")
    ] = "turtlebot2",
    minutes: Annotated[float, typer.Option(help="Simulated minutes of the memory check.")] = 10.0,
) -> None:
    """Run the conformance suite against a method; exit status 1 if a check fails.

    Example:
        taskslam methods check karto --option correlation_search_space_resolution=0.02
    """
    from rich.text import Text

    from taskslam.benchmark.conformance_eyes import conformance_looks
    from taskslam.robot import load_robot
    from taskslam.slam.conformance.check import Verdict, check_method

    console = standard_output()

    def show_result(result: CheckResult) -> None:
        verdict = (result.verdict, _STYLES[result.verdict])
        console.print(Text.assemble(verdict, "  ", (result.name, "bold"), f": {result.detail}"), soft_wrap=True)

    options = parse_options(option or [])
    results = check_method(
        name, options, load_robot(robot).rig, minutes, on_result=show_result, make_looks=conformance_looks
    )
    failed = sum(result.verdict is Verdict.FAILED for result in results)
    skipped = sum(result.verdict is Verdict.SKIPPED for result in results)
    console.print(f"{len(results) - failed - skipped} passed, {failed} failed, {skipped} skipped")
    if failed:
        raise typer.Exit(1)


def _opened(card: MethodCard) -> list[str]:
    """What a method needs opened in the wall around it."""
    tcp, memory = ["TCP"] * card.loopback, ["shared memory"] * card.shared_memory
    return [*tcp, *memory, *(f"reads {place}" for place in card.reads)]


def _card_rows(card: MethodCard) -> list[tuple[str, str]]:
    return [
        ("name", f"{card.name} {card.version}"),
        ("summary", card.summary or "-"),
        ("kind", card.kind),
        ("licence", card.licence),
        ("sensors", ", ".join(card.sensors)),
        ("optional sensors", ", ".join(card.optional_sensors) or "none"),
        ("odometry prior", "yes" if card.odometry_prior else "no"),
        ("still start", f"{card.needs_still_start:g} s"),
        ("with-map rounds", card.map_mode),
        ("saves maps", "yes" if card.can_save_map else "no"),
        ("deterministic", "yes" if card.deterministic else "no"),
        ("asynchronous", "yes" if card.asynchronous else "no"),
        ("latency", "not named" if card.latency is None else f"{card.latency * 1e3:g} ms"),
        ("queue", f"{card.queue} frame{'s' if card.queue != 1 else ''}"),
        ("beyond the wall", ", ".join(_opened(card)) or "nothing"),
        ("homepage", card.homepage or "-"),
        ("extra", card.extra or "none needed"),
    ]
