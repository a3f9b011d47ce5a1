"""What was run, each fact once: where runs differ, each value with the runs that it belongs to."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from taskslam.report import words
from taskslam.report.results import Run

_MOST_NAMES = 3


@dataclass(frozen=True)
class Fact:
    """A name and its values; whose: which runs a value belongs to, empty if all runs agree."""

    name: str
    values: tuple[tuple[str, str], ...]


def facts(runs: Sequence[Run]) -> list[Fact]:
    """The facts of all runs on the page; one that no run states is left out."""
    tellers: tuple[tuple[str, Callable[[Run], str]], ...] = (
        ("Scenario", _scenario),
        ("Robot", lambda run: _text(run.manifest.scenario.get("robot"))),
        ("Task units", _units),
        ("Navigation stops within", _tolerance),
        ("Protocol", _protocol),
        ("Modes", lambda run: words.mode(run.mode)),
        ("Seed", lambda run: str(run.metrics.seed)),
        ("Latency", _latency),
        ("Software", lambda run: _pairs(run.manifest.versions, " ")),
        ("Machine", lambda run: _pairs(run.manifest.machine, " ")),
    )
    stated = [Fact(name, _values(runs, tell)) for name, tell in tellers]
    return [*(fact for fact in stated if fact.values), Fact("Time", ((_time(runs), ""),))]


def rounds_of(runs: Sequence[Run]) -> list[tuple[int, str]]:
    """Each number of rounds with the runs that planned so many."""
    numbers = sorted({run.metrics.rounds for run in runs})
    return [(number, _whose([run.name for run in runs if run.metrics.rounds == number])) for number in numbers]


def _values(runs: Sequence[Run], tell: Callable[[Run], str]) -> tuple[tuple[str, str], ...]:
    owners: dict[str, list[str]] = {}
    for run in runs:
        if text := tell(run):
            owners.setdefault(text, []).append(run.name)
    if len(owners) == 1 and len(next(iter(owners.values()))) == len(runs):
        return ((next(iter(owners)), ""),)
    return tuple((text, _whose(names)) for text, names in owners.items())


def _whose(names: Sequence[str]) -> str:
    if len(names) <= _MOST_NAMES:
        return "; ".join(names)
    return f"{len(names)} runs"


def _scenario(run: Run) -> str:
    manifest = run.manifest
    title = (
        manifest.title if manifest.title == manifest.scenario_name else f"{manifest.title} ({manifest.scenario_name})"
    )
    return f"{title}: {len(manifest.goals)} goals, content hash {manifest.scenario_hash[:16]}"


def _units(run: Run) -> str:
    manifest = run.manifest
    return (
        f"D = {100 * manifest.robot_diameter:g} cm (robot diameter), FoV = {manifest.field_of_view:g}° (field of view)"
    )


def _tolerance(run: Run) -> str:
    tolerance = run.manifest.goal_tolerance
    return (
        f"{100 * tolerance.position_m:g} cm and {math.degrees(tolerance.heading_rad):.1f}° of the goal, as SLAM sees it"
    )


def _protocol(run: Run) -> str:
    content = run.manifest.scenario.get("protocol")
    parts = [f"{run.metrics.rounds} round{'s' * (run.metrics.rounds != 1)}"]
    if isinstance(content, Mapping):
        if content.get("pause") is not None:
            parts.append(f"{_text(content['pause'])} s of pause at each goal")
        if content.get("still_start"):
            parts.append(f"{_text(content['still_start'])} s of standing still first")
        if content.get("goal_timeout"):
            parts.append(f"at most {_text(content['goal_timeout'])} s a goal")
        if content.get("on_failure"):
            then = {"abort": "a failed goal ends the round", "skip": "a failed goal is skipped"}
            parts.append(then.get(str(content["on_failure"]), _text(content["on_failure"])))
    return ", ".join(parts)


def _latency(run: Run) -> str:
    kind = run.manifest.latency
    meaning = {"fixed": "fixed: the value on each method's card", "zero": "zero: every estimate arrives at once"}
    if kind == "fixed" and run.manifest.method_card.get("latency", 0.0) is None:
        return "fixed, but the method's card names none: every estimate arrives at once"
    return meaning.get(kind, kind)


def _time(runs: Sequence[Run]) -> str:
    simulated = math.fsum(run.metrics.simulated_s for run in runs)
    wall = math.fsum(run.metrics.wall_s for run in runs)
    days = sorted(run.manifest.started_utc[:10] for run in runs)
    when = days[0] if days[0] == days[-1] else f"{days[0]} to {days[-1]}"
    return f"{words.hours(simulated)} simulated in {words.hours(wall)} of computing, started {when}"


def _pairs(values: Mapping[str, Any], between: str) -> str:
    return ", ".join(f"{name}{between}{_text(value)}" for name, value in values.items())


def _text(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, Mapping):
        return str(value.get("name") or _pairs(value, " = "))
    return f"{value:g}" if isinstance(value, float) else str(value)
