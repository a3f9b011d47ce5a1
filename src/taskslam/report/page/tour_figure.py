"""The floor plan with the tour on it: waypoints, true and estimated trajectories of every round, failures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from markupsafe import Markup

from taskslam.evaluation import RunMetrics
from taskslam.geometry import SE2, FloatArray
from taskslam.record import RoundStarted, RunRecord
from taskslam.report import palette
from taskslam.report.page.plan_drawing import PlanView, begin_plan, draw_failure, draw_start, draw_waypoint, plan_view
from taskslam.report.simplify import simplified
from taskslam.report.svg import Svg
from taskslam.report.tracks import Tracks
from taskslam.world import FloorPlan

_TOLERANCE = 0.4  # of a drawing 1000 wide: what leaving points out may move a line by


def tour_figure(record: RunRecord, metrics: RunMetrics, plan: FloorPlan | None, tracks: Tracks) -> Markup:
    """Draw the tour of one run; without a floor plan, on white."""
    truths = {start: tracks.get(start.round, "truth").poses for start in record.rounds()}
    goals = np.array([goal.array()[:2] for goal in record.manifest.goals])
    view = plan_view(plan, [goals, *truths.values()])
    svg = begin_plan(
        plan, view, f"Floor plan with {len(metrics.waypoints)} waypoints and the trajectories of {metrics.method}"
    )
    _draw_trajectories(svg, tracks, truths, view)
    if record.manifest.start is not None:
        draw_start(svg, record.manifest.start, view)
    for waypoint in metrics.waypoints:
        draw_waypoint(svg, SE2(*waypoint.target), str(waypoint.goal + 1), waypoint.complete, view)
    for failure in metrics.failures:
        if failure.truth is not None:
            draw_failure(svg, SE2(*failure.truth), view)
    return svg.markup()


def _draw_trajectories(svg: Svg, tracks: Tracks, truths: Mapping[RoundStarted, FloatArray], view: PlanView) -> None:
    """Estimates as a broad band underneath, truth as a fine line on top; the priming round in grey."""
    joined = {"stroke_linejoin": "round", "stroke_linecap": "round"}
    with svg.group(stroke=palette.BELIEF, stroke_width=5, stroke_opacity=0.5, **joined):
        for start in truths:
            if not start.priming:
                _draw_path(svg, tracks.get(start.round, "estimate").poses, view)
    for start, poses in truths.items():
        colour = palette.MUTED if start.priming else palette.TRUTH
        dash = {"stroke_dasharray": "2 4"} if start.priming else {}
        with svg.group(stroke=colour, stroke_width=1.5, stroke_opacity=1, **joined, **dash):
            _draw_path(svg, poses, view)


def _draw_path(svg: Svg, poses: FloatArray, view: PlanView) -> None:
    if len(poses) > 1:
        svg.polyline(simplified(view(poses), _TOLERANCE))
