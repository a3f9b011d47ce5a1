"""What the page's script needs to show the rounds of a waypoint: plain numbers, embedded as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

from taskslam.evaluation import WaypointMetrics
from taskslam.geometry import SE2, wrap_angle
from taskslam.mode import Mode
from taskslam.printable import one_line
from taskslam.report.goal_frame import seen_from_goal
from taskslam.report.page.shell import json_in_script
from taskslam.report.page.views import RunView, ScenarioView
from taskslam.report.palette import on_page


def page_data(scenarios: Sequence[ScenarioView]) -> Markup:
    """JSON of all runs for a script element.

    An arrival is [round, x, y, heading, x and y of SLAM's belief, seconds]: metres ahead of the goal and to its left,
    radians from its heading; null where unknown.
    """
    data = {
        "modes": list(Mode),
        "scenarios": {scenario.anchor: _scenario(scenario) for scenario in scenarios},
        "runs": {run.anchor: _run(run, scenario.anchor) for scenario in scenarios for run in scenario.runs},
    }
    return json_in_script(data)


def _scenario(scenario: ScenarioView) -> dict[str, Any]:
    manifest = scenario.runs[0].manifest
    return {
        "title": one_line(scenario.title),
        "diameter": manifest.robot_diameter,
        "field": manifest.field_of_view,
        "tolerance": manifest.goal_tolerance.position_m,
    }


def _run(run: RunView, scenario: str) -> dict[str, Any]:
    return {
        "name": one_line(run.name),
        "label": one_line(run.label),
        "method": run.style.key,
        "mode": run.metrics.mode,
        "colour": on_page(run.style.colour),
        "scenario": scenario,
        "waypoints": [_waypoint(run, waypoint.metrics) for waypoint in run.waypoints],
    }


def _waypoint(run: RunView, waypoint: WaypointMetrics) -> dict[str, Any]:
    rows = [
        [
            run.metrics.round_name(visit.round),
            *_place(truth),
            None if truth is None else round(wrap_angle(truth.theta), 5),
            *_place(belief),
            round(visit.t_s, 1),
        ]
        for visit, truth, belief in seen_from_goal(waypoint)
    ]
    return {
        "E": _short(waypoint.position.precision_m),
        "e": _short(waypoint.position.accuracy_m),
        "H": _short(waypoint.orientation.precision_rad),
        "visits": waypoint.visits,
        "rounds": waypoint.rounds,
        "unjudged": waypoint.unjudged is not None,
        "arrivals": rows,
    }


def _place(pose: SE2 | None) -> tuple[float, float] | tuple[None, None]:
    return (None, None) if pose is None else (round(pose.x, 5), round(pose.y, 5))


def _short(value: float | None) -> float | None:
    return None if value is None else round(value, 6)
