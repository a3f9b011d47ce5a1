"""Reading a scenario: shipped by name or a user's YAML file, with `a.b=c` overrides; every complaint names its key."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from taskslam.errors import ScenarioError
from taskslam.scenario.scenario import Scenario
from taskslam.scenario.waypoint_files import read_path, read_waypoints
from taskslam.user_files import Shipped, check, value_of

_SHIPPED = Shipped("scenario", "taskslam.scenario", "scenarios", ScenarioError)


def shipped_scenarios() -> list[str]:
    """Names of the scenarios that ship with the package."""
    return _SHIPPED.names()


def load_scenario(reference: str | Path, overrides: Sequence[str] = ()) -> Scenario:
    """A scenario by shipped name or YAML file, with overrides such as `protocol.rounds=3`.

    Raises:
        ScenarioError: unknown name or key (with a guess at what was meant), a value out of range, an empty sequence,
            a path index past the table, an unreadable waypoint file.
    """
    raw, where = _SHIPPED.read(reference, Scenario)
    for override in overrides:
        _apply(raw, override)
    folder = Path.cwd() if where.startswith("scenario ") else Path(reference).resolve().parent
    scenario = check(Scenario, _with_files(raw, where, folder), where, ScenarioError)
    _check_sequence(scenario, where)
    return scenario


def _apply(raw: dict[str, Any], override: str) -> None:
    key, equals, value = override.partition("=")
    if not equals or not key:
        raise ScenarioError(f"--set {override}: expected a.b=value")
    *parents, leaf = key.split(".")
    at = raw
    for parent in parents:
        at = at.setdefault(parent, {})
        if not isinstance(at, dict):
            raise ScenarioError(f"--set {override}: '{parent}' holds a value, not keys")
    at[leaf] = value_of(value, f"--set {override}", ScenarioError)


def _with_files(raw: dict[str, Any], where: str, folder: Path) -> dict[str, Any]:
    """Read `sequence.waypoints_file` and `path_file` into tables; make the map's path absolute."""
    sequence = raw.get("sequence")
    if isinstance(sequence, dict):
        sequence = dict(sequence)
        for key, table, reader in (("waypoints_file", "waypoints", read_waypoints), ("path_file", "path", read_path)):
            if isinstance(sequence.get(key), str):
                if sequence.get(table):
                    raise ScenarioError(f"{where}: sequence: give either {table} or {key}, not both")
                sequence[table] = reader(folder / sequence.pop(key))
        raw = {**raw, "sequence": sequence}
    plan = raw.get("floor_plan")
    if isinstance(plan, dict) and isinstance(plan.get("map"), str):
        raw = {**raw, "floor_plan": {**plan, "map": str(folder / Path(plan["map"]).expanduser())}}
    return raw


def _check_sequence(scenario: Scenario, where: str) -> None:
    if not scenario.sequence.goals:
        raise ScenarioError(
            f"{where}: sequence is empty: expected at least one goal (a path's first entry is the start, not a goal)"
        )
