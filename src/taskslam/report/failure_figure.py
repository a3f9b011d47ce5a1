"""The floor plan with every failure of a scenario on it, numbered as in the table below it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from taskslam.geometry import SE2
from taskslam.report import palette
from taskslam.report.plan_drawing import begin_plan, draw_failure, draw_start, draw_waypoint, plan_view
from taskslam.world import FloorPlan

_NEAR = 26.0  # of a drawing 1000 wide: marks closer than this would hide one another's number


def failure_figure(
    plan: FloorPlan | None, start: SE2 | None, goals: Sequence[SE2], places: Sequence[tuple[int, SE2]]
) -> Markup:
    """Draw crosses at the true poses where goals failed. places: the number of each failure and where it was."""
    points = [np.array([[pose.x, pose.y] for pose in (*goals, *(place for _, place in places))])]
    view = plan_view(plan, points)
    svg = begin_plan(plan, view, f"Floor plan with {len(places)} failures")
    if start is not None:
        draw_start(svg, start, view)
    for number, goal in enumerate(goals, start=1):
        draw_waypoint(svg, goal, str(number), True, view)
    groups: list[tuple[SE2, list[int]]] = []
    for number, pose in places:
        for at, numbers in groups:
            if np.hypot(at.x - pose.x, at.y - pose.y) * view.scale < _NEAR:
                numbers.append(number)
                break
        else:
            groups.append((pose, [number]))
    for at, _ in groups:
        draw_failure(svg, at, view)
    for at, numbers in groups:
        x, y = view(np.array([[at.x, at.y]]))[0]
        side, anchor = (15, "start") if x < 0.8 * view.width else (-15, "end")
        svg.text(x + side, y + 5, number_list(numbers), fill=palette.FAILURE, font_size=15, font_weight=700,
                 text_anchor=anchor, class_="halo")  # fmt: skip
    return svg.markup()


def number_list(numbers: Sequence[int]) -> str:
    """Sorted numbers with runs of neighbours drawn together: `1-3, 7`."""
    parts: list[list[int]] = []
    for number in sorted(numbers):
        if parts and number == parts[-1][-1] + 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    return ", ".join(str(part[0]) if len(part) == 1 else f"{part[0]}\u2013{part[-1]}" for part in parts)
