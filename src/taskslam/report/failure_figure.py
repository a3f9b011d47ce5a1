"""The floor plan with every failure of a scenario on it, numbered as in the table below it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from taskslam.geometry import SE2
from taskslam.report import palette
from taskslam.report.labels import place_labels
from taskslam.report.plan_drawing import begin_plan, draw_failure, draw_start, draw_waypoint, plan_view
from taskslam.world import FloorPlan

_QUIET = "#9aa3b0"  # waypoints stand back behind the crosses
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
        draw_waypoint(svg, goal, str(number), True, view, ink=_QUIET)
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
    marks = [(float(x), float(y)) for x, y in (view(np.array([[at.x, at.y]]))[0] for at, _ in groups)]
    texts = [number_list(numbers) for _, numbers in groups]
    area = (0.0, 0.0, view.width, view.height)
    for (x, y), text, place in zip(marks, texts, place_labels(marks, texts, 12.0, 15.0, area), strict=True):
        at_x, at_y = place or (x + 15, y + 5)  # crowded: on top of something, but never left out
        svg.text(at_x, at_y, text, fill=palette.FAILURE, font_size=15, font_weight=700, class_="halo")
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
