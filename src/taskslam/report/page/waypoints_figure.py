"""The floor plan of a scenario: its goals, each a link under which a script shows the rounds, and every failure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from taskslam.geometry import SE2
from taskslam.report.page.failure_marks import FailurePlace, draw_failures
from taskslam.report.page.plan_drawing import begin_plan, draw_start, draw_waypoint, plan_view
from taskslam.world import FloorPlan


def waypoints_figure(
    plan: FloorPlan | None,
    start: SE2 | None,
    goals: Sequence[SE2],
    complete: Sequence[bool],
    failures: Sequence[FailurePlace],
    anchor: str,
) -> Markup:
    """Draw it. complete: whether every run of the scenario reached a goal every time; anchor: of the scenario."""
    poses = [*goals, *((start,) if start else ()), *(failure.at for failure in failures)]
    view = plan_view(plan, [np.array([[pose.x, pose.y] for pose in poses])])
    svg = begin_plan(plan, view, f"Floor plan with {len(goals)} waypoints and {len(failures)} failures", "group")
    if start is not None:
        draw_start(svg, start, view)
    for index, (goal, always) in enumerate(zip(goals, complete, strict=True)):
        attributes = {
            "href": f"#{anchor}-waypoints",
            "class_": "goal",
            "data_scenario": anchor,
            "data_goal": index,
            "aria_label": f"Waypoint {index + 1}",
        }
        with svg.group("a", **attributes):
            x, y = view(np.array([[goal.x, goal.y]]))[0]
            svg.circle(float(x), float(y), 22, fill="transparent")  # a target that a finger can hit
            draw_waypoint(svg, goal, str(index + 1), always, view)
    draw_failures(svg, failures, view)
    return svg.markup()
