"""A tour before it is driven, as one self-contained page: plan, goals, planned ways, clearances, what is wrong."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from markupsafe import Markup

from taskslam.benchmark.survey import Survey
from taskslam.files import write_whole, writing
from taskslam.printable import printable
from taskslam.report import palette
from taskslam.report.page.plan_drawing import (
    begin_plan,
    draw_failure,
    draw_start,
    draw_waypoint,
    plan_pictures,
    plan_view,
)
from taskslam.report.page.shell import render
from taskslam.report.simplify import simplified
from taskslam.robot import Robot
from taskslam.scenario import Scenario
from taskslam.world import FloorPlan

_TOLERANCE = 0.4  # of the drawing's units: what leaving points out may move a line by


def write_preview(scenario: Scenario, plan: FloorPlan, robot: Robot, looked: Survey, out: Path) -> None:
    """Write the page.

    Raises DiskFullError, RecordError: it cannot be written.
    """
    page = render(
        "preview.html",
        [],
        [],
        [],
        scenario=scenario,
        robot=robot,
        looked=looked,
        title=scenario.title or scenario.name,
        plans=plan_pictures([plan]),
        drawing=tour_drawing(plan, looked),
        degrees=math.degrees,
    )
    with writing(out):
        out.absolute().parent.mkdir(parents=True, exist_ok=True)
    write_whole(out, printable(page))


def tour_drawing(plan: FloorPlan, looked: Survey) -> Markup:
    """Floor plan, planned ways, start and goals; a cross on what is wrong."""
    shown = [(n, leg) for n, leg in enumerate(looked.legs, start=1) if not math.isnan(leg.clearance_m)]  # on the plan
    view = plan_view(plan, [np.array([place.array()[:2]]) for place in (looked.start, *(leg.goal for _, leg in shown))])
    svg = begin_plan(
        plan, view, f"Floor plan with the start, {len(looked.legs)} goals and the planned ways between them"
    )
    with svg.group(stroke=palette.TRUTH, stroke_width=2.0, stroke_linejoin="round", stroke_linecap="round"):
        for leg in looked.legs:
            if leg.path is not None:
                svg.polyline(simplified(view(leg.path), _TOLERANCE))
    draw_start(svg, looked.start, view)
    if looked.start_fault:
        draw_failure(svg, looked.start, view)
    for number, leg in shown:
        draw_waypoint(svg, leg.goal, str(number), not leg.fault, view)
        if leg.fault:
            draw_failure(svg, leg.goal, view)
    return svg.markup()
