"""The page on which a tour is edited, and what it says to the program that serves it (`loopback.py`)."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from taskslam.benchmark.survey import Survey, survey
from taskslam.errors import ScenarioError
from taskslam.report.page.plan_drawing import begin_plan, plan_pictures, plan_view
from taskslam.report.page.shell import render
from taskslam.report.simplify import simplified
from taskslam.robot import Robot
from taskslam.scenario import Scenario
from taskslam.scenario.writing import save_scenario
from taskslam.task import MOST_GOALS, Sequence, Waypoint
from taskslam.user_files import complaint
from taskslam.world import FloorPlan

_TOLERANCE = 0.01  # m that leaving points out may move a way by


class _Tour(BaseModel):
    """What the page says: poses x, y, heading, m and rad."""

    model_config = ConfigDict(extra="forbid")

    start: tuple[float, float, float]
    goals: list[tuple[float, float, float]] = Field(max_length=MOST_GOALS)


class Editor:
    """A scenario on its plan, to be changed by a person, and the file into which it is saved."""

    def __init__(self, scenario: Scenario, plan: FloorPlan, robot: Robot, file: Path) -> None:
        self._scenario, self._plan, self._robot, self._file = scenario, plan, robot, file

    def page(self) -> str:
        """The page, with the tour as the scenario has it."""
        scenario, plan = self._scenario, self._plan
        view = plan_view(plan, [np.array([scenario.start.pose.array()[:2]])])
        poses = [[place.x, place.y, place.theta] for place in (scenario.start, *scenario.sequence.goals)]
        data = {
            "start": poses[0],
            "goals": poses[1:],
            "view": {"left": view.left, "top": view.top, "scale": view.scale},
        }
        return render(
            "editor.html",
            [],
            [],
            [],
            served_by="editor",
            title=scenario.title or scenario.name,
            robot=self._robot,
            file=self._file.name,
            plans=plan_pictures([plan]),
            drawing=begin_plan(plan, view, "Floor plan with the tour", role="group").markup(),
            data=Markup(json.dumps(data).replace("<", "\\u003c")),  # noqa: S704 JSON, in which no tag can begin
        )

    @property
    def acts(self) -> Mapping[str, Callable[[bytes], Mapping[str, Any]]]:
        """What the page may ask for, by name: each takes the tour as JSON and answers with JSON."""
        return {"survey": self.survey, "save": self.save}

    def survey(self, said: bytes) -> Mapping[str, Any]:
        """How the robot would drive the tour. Raises ScenarioError if what is said is no tour."""
        return _told(survey(self._changed(said), self._plan, self._robot))

    def save(self, said: bytes) -> Mapping[str, Any]:
        """Save the tour. Raises ScenarioError if what is said is no tour; DiskFullError, RecordError."""
        changed = self._changed(said)
        if not changed.sequence.goals:
            raise ScenarioError("a tour without a goal is none; expected one at least")
        save_scenario(changed, self._file)
        return {"saved": str(self._file)}

    def _changed(self, said: bytes) -> Scenario:
        try:
            tour = _Tour.model_validate_json(said)
            start, *goals = (Waypoint(x=x, y=y, theta=theta) for x, y, theta in (tour.start, *tour.goals))
        except ValidationError as error:
            raise ScenarioError(f"the tour: {complaint(error, _Tour)}") from None
        return self._scenario.model_copy(update={"start": start, "sequence": Sequence(waypoints=tuple(goals))})


def _told(looked: Survey) -> dict[str, Any]:
    legs = [
        {
            "path": None if leg.path is None else simplified(leg.path, _TOLERANCE).round(3).tolist(),
            "length_m": leg.length_m,
            "clearance_m": leg.clearance_m if math.isfinite(leg.clearance_m) else None,
            "narrowest_m": leg.narrowest_m if math.isfinite(leg.narrowest_m) else None,
            "fault": leg.fault,
        }
        for leg in looked.legs
    ]
    return {"legs": legs, "start_fault": looked.start_fault, "faults": looked.faults, "length_m": looked.length_m}
