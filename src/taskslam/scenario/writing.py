"""A scenario as a YAML file that a person may go on writing: what is as always is left out, a waypoint is a row."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from taskslam.files import write_whole, writing
from taskslam.scenario.scenario import Scenario


def save_scenario(scenario: Scenario, path: Path) -> None:
    """Write a scenario; `load_scenario` gives it back. A map is named from the file's folder, where it lies below that.

    Raises DiskFullError, RecordError: it cannot be written.
    """
    with writing(path):
        path.absolute().parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, scenario_text(scenario, path.absolute().parent))


def scenario_text(scenario: Scenario, folder: Path) -> str:
    """What `save_scenario` writes into a file in `folder`."""
    content: dict[str, Any] = scenario.model_dump(mode="json", exclude_defaults=True)
    content["start"] = scenario.start.model_dump()
    if scenario.world is not None:
        content["world"] = {key: value for key, value in content["world"].items() if value is not None}
    if scenario.floor_plan.map is not None:
        content["floor_plan"]["map"] = _from(folder, Path(scenario.floor_plan.map))
    if scenario.sequence.waypoints:
        content["sequence"]["waypoints"] = [[w.x, w.y, w.theta] for w in scenario.sequence.waypoints]
    ordered = {key: content[key] for key in Scenario.model_fields if key in content}
    ordered["sequence"] = ordered.pop("sequence")  # the long part comes last
    return str(yaml.safe_dump(ordered, sort_keys=False, allow_unicode=True, default_flow_style=None))


def _from(folder: Path, file: Path) -> str:
    absolute = file.absolute()
    return str(absolute.relative_to(folder)) if absolute.is_relative_to(folder) else str(absolute)
