"""Reading a scenario: shipped by name or a user's YAML file, with `a.b=c` overrides; every complaint names its key."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ValidationError

from taskslam.errors import ScenarioError, did_you_mean
from taskslam.scenario.scenario import Scenario
from taskslam.scenario.waypoint_files import read_path, read_waypoints


def shipped_scenarios() -> list[str]:
    """Names of the scenarios that ship with the package."""
    folder = resources.files("taskslam.scenario") / "scenarios"
    return sorted(Path(f.name).stem for f in folder.iterdir() if f.name.endswith(".yaml"))


def load_scenario(reference: str | Path, overrides: Sequence[str] = ()) -> Scenario:
    """A scenario by shipped name or YAML file, with overrides such as `protocol.rounds=3`.

    Raises:
        ScenarioError: unknown name or key (with a guess at what was meant), a value out of range, an empty sequence,
            a path index past the table, an unreadable waypoint file.
    """
    text, where, folder = _read(reference)
    try:
        raw = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ScenarioError(f"{where}: not valid YAML: {' '.join(str(error).split())}") from error
    if not isinstance(raw, dict):
        raise ScenarioError(f"{where}: a scenario is a mapping with the keys {', '.join(Scenario.model_fields)}")
    for override in overrides:
        _apply(raw, override)
    raw = _with_files(raw, where, folder)
    try:
        scenario = Scenario.model_validate(raw)
    except ValidationError as error:
        raise ScenarioError(f"{where}: {_first_complaint(error)}") from error
    _check_sequence(scenario, where)
    return scenario


def _read(reference: str | Path) -> tuple[str, str, Path | None]:
    path = Path(reference)
    if path.suffix in {".yaml", ".yml"}:
        try:
            return path.read_text(encoding="utf-8"), str(path), path.resolve().parent
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
            raise ScenarioError(f"{path}: cannot read the scenario: {reason}") from error
    known = shipped_scenarios()
    if str(reference) not in known:
        hint = did_you_mean(str(reference), known)
        raise ScenarioError(f"scenario '{reference}' is neither shipped ({', '.join(known)}) nor a .yaml file.{hint}")
    file = resources.files("taskslam.scenario") / "scenarios" / f"{reference}.yaml"
    return file.read_text(encoding="utf-8"), f"scenario {reference}", None


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
    try:
        at[leaf] = yaml.safe_load(value)
    except yaml.YAMLError as error:
        raise ScenarioError(f"--set {override}: '{value}' is not a YAML value") from error


def _with_files(raw: dict[str, Any], where: str, folder: Path | None) -> dict[str, Any]:
    """Read `sequence.waypoints_file` and `path_file` into tables; make the map's path absolute."""
    base = folder or Path.cwd()
    sequence = raw.get("sequence")
    if isinstance(sequence, dict):
        sequence = dict(sequence)
        for key, table, reader in (("waypoints_file", "waypoints", read_waypoints), ("path_file", "path", read_path)):
            if isinstance(sequence.get(key), str):
                if sequence.get(table):
                    raise ScenarioError(f"{where}: sequence: give either {table} or {key}, not both")
                sequence[table] = reader(base / sequence[key])
        raw = {**raw, "sequence": sequence}
    plan = raw.get("floor_plan")
    if isinstance(plan, dict) and isinstance(plan.get("map"), str):
        raw = {**raw, "floor_plan": {**plan, "map": str(base / Path(plan["map"]).expanduser())}}
    return raw


def _check_sequence(scenario: Scenario, where: str) -> None:
    sequence = scenario.sequence
    for place, row in enumerate(sequence.path or ()):
        if not 0 <= row < len(sequence.waypoints):
            raise ScenarioError(
                f"{where}: sequence.path[{place}] is {row}, but the waypoint table has rows 0 to"
                f" {len(sequence.waypoints) - 1}"
            )
    if not sequence.goals:
        raise ScenarioError(
            f"{where}: sequence is empty: expected at least one goal (a path's first entry is the start, not a goal)"
        )


def _first_complaint(error: ValidationError) -> str:
    first = error.errors()[0]
    location = [str(part) for part in first["loc"]]
    key = ".".join(location)
    if first["type"] == "extra_forbidden":
        known = _keys_at(Scenario, location[:-1])
        return f"unknown key '{key}'; expected one of {', '.join(known)}.{did_you_mean(location[-1], known)}"
    if first["type"] == "missing":
        return f"the key '{key}' is missing"
    return f"{key}: {first['msg']} (got {first['input']!r})"


def _keys_at(model: type[BaseModel], location: Iterable[str]) -> list[str]:
    for part in location:
        field = model.model_fields.get(part)
        annotation = field.annotation if field else None
        if not (isinstance(annotation, type) and issubclass(annotation, BaseModel)):
            break
        model = annotation
    return list(model.model_fields)
