"""Recorded runs over one another on the ground truth, seen along the coordinate that it spans least, or on a map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from markupsafe import Markup

from taskslam.report import palette
from taskslam.report.drawn_run import DrawnRun, Ground
from taskslam.report.markers import Style
from taskslam.report.page.plan_drawing import begin_plan, plan_view
from taskslam.world import FloorPlan

_WIDTH, _HEIGHT = 520.0, 520.0
_MANY = 12  # lines; more are drawn fainter


def path_figure(
    on: Ground, runs: Sequence[DrawnRun], styles: Mapping[str, Style], plan: FloorPlan | None, sequence: str
) -> Markup:
    """Draw every run in the colour of its method, and the ground truth as a dashed line above them."""
    paths = [stretch.path for run in runs for stretch in run.stretches]
    view = plan_view(plan, [on.path, *paths], _WIDTH, _HEIGHT)
    svg = begin_plan(plan, view, f"{len(runs)} runs over one another on {sequence}, and the ground truth")
    joined = {"stroke_linejoin": "round", "stroke_linecap": "round"}
    for run in runs:
        style = styles[run.method]
        ink = {"stroke": style.colour, "stroke_width": 1.6, "stroke_opacity": 0.85 if len(runs) <= _MANY else 0.45}
        with svg.group(data_method=style.key, **ink, **joined):
            svg.add("title", f"{run.method}: {run.file}")
            for stretch in run.stretches:
                svg.polyline(view(stretch.path))
    svg.polyline(view(on.path), stroke=palette.INK, stroke_width=1.1, stroke_dasharray="5 4", **joined)
    right, up = ("xyz"[axis] for axis in on.axes[:2])
    svg.text(view.width - 4, view.height + 22.5, f"{right} →, {up} ↑", fill=palette.MUTED, font_size=13,
             text_anchor="end")  # fmt: skip
    return svg.markup()
