"""Crosses on a floor plan where goals failed, numbered as in the list of failures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taskslam.geometry import SE2
from taskslam.report import palette
from taskslam.report.labels import place_labels
from taskslam.report.page.plan_drawing import PlanView, draw_failure
from taskslam.report.svg import Svg

_NEAR = 26.0  # of a drawing 1000 wide: marks closer than this would hide one another's number


@dataclass(frozen=True)
class FailurePlace:
    """Where a failure happened. number: of the failure; method, mode: what the page's filter knows its run by."""

    number: int
    at: SE2
    method: str
    mode: str


def draw_failures(svg: Svg, places: Sequence[FailurePlace], view: PlanView) -> None:
    """Draw a cross for each place; near ones share one, which the filter may hide if all are of one method or mode."""
    groups: list[list[FailurePlace]] = []
    for place in places:
        for group in groups:
            if group[0].at.distance_to(place.at) * view.scale < _NEAR:
                group.append(place)
                break
        else:
            groups.append([place])
    marks = [(float(x), float(y)) for x, y in (view(np.array([[group[0].at.x, group[0].at.y]]))[0] for group in groups)]
    texts = [number_list([place.number for place in group]) for group in groups]
    labels = place_labels(marks, texts, 12.0, 15.0, (0.0, 0.0, view.width, view.height))
    for group, (x, y), text, label in zip(groups, marks, texts, labels, strict=True):
        methods, modes = {place.method for place in group}, {place.mode for place in group}
        shared = {
            **({"data_method": group[0].method} if len(methods) == 1 else {}),
            **({"data_mode": group[0].mode} if len(modes) == 1 else {}),
        }
        with svg.group(pointer_events="none", **shared):  # the goal beneath stays within reach
            draw_failure(svg, group[0].at, view)
            at_x, at_y = label or (x + 15, y + 5)  # crowded: on top of something, but never left out
            svg.text(at_x, at_y, text, fill=palette.FAILURE, font_size=15, font_weight=700, class_="halo")


def number_list(numbers: Sequence[int]) -> str:
    """Sorted numbers with runs of neighbours drawn together: `1-3, 7`."""
    parts: list[list[int]] = []
    for number in sorted(numbers):
        if parts and number == parts[-1][-1] + 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    return ", ".join(str(part[0]) if len(part) == 1 else f"{part[0]}\u2013{part[-1]}" for part in parts)
