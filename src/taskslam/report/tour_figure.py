"""The floor plan with the tour on it: waypoints, true and estimated trajectories of every round, failures."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from PIL import Image

from taskslam.evaluation import RunMetrics
from taskslam.geometry import SE2, FloatArray, transform_points
from taskslam.record import RoundStarted, RunRecord
from taskslam.report import palette
from taskslam.report.svg import Svg
from taskslam.world import FloorPlan
from taskslam.world.floor_plan import FREE, OCCUPIED, UNKNOWN

_WIDTH, _HEIGHT = 1000.0, 1100.0  # the most that the drawing may take
_MARGIN = 0.6  # m around what is drawn
_STEP = 0.04  # m between drawn trajectory points


@dataclass(frozen=True)
class _View:
    """From `map` in metres to the drawing: x right, y up."""

    left: float
    top: float
    scale: float

    def __call__(self, points: FloatArray) -> FloatArray:
        """(N, 2) drawing coordinates of (N, 2) points in `map`."""
        return (np.asarray(points, dtype=np.float64)[:, :2] - [self.left, self.top]) * [self.scale, -self.scale]


def tour_figure(record: RunRecord, metrics: RunMetrics, plan: FloorPlan | None) -> Markup:
    """Draw the tour of one run; without a floor plan, on white."""
    truths = {start: record.trajectory(start.round, "truth").poses for start in record.rounds()}
    corners = _extent(record, plan, truths.values())
    size = corners[1] - corners[0]
    scale = float(min(_WIDTH / size[0], _HEIGHT / size[1]))
    view = _View(float(corners[0, 0]), float(corners[1, 1]), scale)
    width, height = size[0] * scale, size[1] * scale
    label = f"Floor plan with {len(metrics.waypoints)} waypoints and the trajectories of {metrics.method}"
    svg = Svg(width, height + 34, label)
    if plan is not None:
        _draw_plan(svg, plan, view)
    _draw_trajectories(svg, record, truths, view)
    if record.manifest.start is not None:
        _draw_start(svg, record.manifest.start, view)
    for waypoint in metrics.waypoints:
        _draw_waypoint(svg, SE2(*waypoint.target), str(waypoint.goal + 1), waypoint.complete, view)
    for failure in metrics.failures:
        if failure.truth is not None:
            _draw_failure(svg, SE2(*failure.truth), view)
    _draw_scale_bar(svg, scale, height + 18)
    return svg.markup()


def _extent(record: RunRecord, plan: FloorPlan | None, truths: Iterable[FloatArray]) -> FloatArray:
    """(2, 2) lowest and highest x, y of known floor, goals and trajectories, with a margin."""
    points = [np.array([goal.array()[:2] for goal in record.manifest.goals])]
    if plan is not None:
        rows, columns = np.nonzero(plan.cells != UNKNOWN)
        if len(rows):
            box = [(r, c) for r in (rows.min(), rows.max() + 1) for c in (columns.min(), columns.max() + 1)]
            points.append(plan.points_of(np.array(box, dtype=np.int64)))
    points.extend(poses[:, :2] for poses in truths)
    everything = np.concatenate(points)
    return np.stack([everything.min(axis=0) - _MARGIN, everything.max(axis=0) + _MARGIN])


def _draw_plan(svg: Svg, plan: FloorPlan, view: _View) -> None:
    rows, columns = plan.cells.shape
    # Pixel (0, 0) of the picture is the top left of the grid, so columns run along x and rows against y.
    corner, along, down = view(
        transform_points(plan.origin, np.array([[0, rows], [1, rows], [0, rows - 1]]) * plan.resolution)
    )
    a, b = along - corner
    c, d = down - corner
    matrix = " ".join(f"{value:.6f}" for value in (a, b, c, d, *corner))
    svg.add(
        "image",
        href=_picture(plan),
        width=columns,
        height=rows,
        transform=f"matrix({matrix})",
        style="image-rendering:pixelated",
        preserveAspectRatio="none",
    )


def _picture(plan: FloorPlan) -> str:
    """The plan as a PNG in a data URI."""
    pixels = np.zeros((*plan.cells.shape, 4), dtype=np.uint8)
    for value, colour in ((FREE, palette.FREE), (OCCUPIED, palette.WALL), (UNKNOWN, palette.UNKNOWN)):
        pixels[plan.cells == value] = colour
    buffer = io.BytesIO()
    Image.fromarray(pixels[::-1].copy()).save(buffer, format="PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def _draw_trajectories(svg: Svg, record: RunRecord, truths: Mapping[RoundStarted, FloatArray], view: _View) -> None:
    """Estimates as a broad band underneath, truth as a fine line on top; the priming round in grey."""
    joined = {"stroke_linejoin": "round", "stroke_linecap": "round"}
    with svg.group(stroke=palette.BELIEF, stroke_width=5, stroke_opacity=0.5, **joined):
        for start in record.rounds():
            if not start.priming:
                _draw_path(svg, record.trajectory(start.round, "estimate").poses, view)
    for start, poses in truths.items():
        colour = palette.MUTED if start.priming else palette.TRUTH
        dash = {"stroke_dasharray": "2 4"} if start.priming else {}
        with svg.group(stroke=colour, stroke_width=1.5, stroke_opacity=1, **joined, **dash):
            _draw_path(svg, poses, view)


def _draw_path(svg: Svg, poses: FloatArray, view: _View) -> None:
    if len(poses) > 1:
        svg.polyline(view(_thinned(poses)))


def _thinned(poses: FloatArray) -> FloatArray:
    """Leave out poses nearer than a step to the last one kept; the last stays."""
    kept = [0]
    points = poses[:, :2].tolist()
    x, y = points[0]
    for index, (px, py) in enumerate(points):
        if math.hypot(px - x, py - y) >= _STEP:
            kept.append(index)
            x, y = px, py
    if kept[-1] != len(points) - 1:
        kept.append(len(points) - 1)
    return poses[kept]


def _draw_waypoint(svg: Svg, target: SE2, label: str, complete: bool, view: _View) -> None:
    x, y = view(np.array([[target.x, target.y]]))[0]
    tip = _ahead(x, y, target.theta, 23)
    base = _ahead(x, y, target.theta, 11)
    left, right = _ahead(*tip, target.theta + 2.6, 7), _ahead(*tip, target.theta - 2.6, 7)
    svg.line(*base, *tip, stroke=palette.INK, stroke_width=1.8)
    svg.polyline(np.array([left, tip, right]), stroke=palette.INK, stroke_width=1.8, stroke_linejoin="round")
    fill = palette.INK if complete else "#ffffff"
    svg.circle(x, y, 11, fill=fill, stroke=palette.INK, stroke_width=1.8)
    ink = "#ffffff" if complete else palette.INK
    svg.text(x, y + 4.3, label, fill=ink, font_size=12, font_weight=600, text_anchor="middle")


def _draw_start(svg: Svg, start: SE2, view: _View) -> None:
    x, y = view(np.array([[start.x, start.y]]))[0]
    corners = np.array([_ahead(x, y, start.theta + turn, 10) for turn in (0, 2.4, -2.4, 0)])
    svg.polyline(corners, stroke=palette.INK, stroke_width=1.8, stroke_linejoin="round")
    svg.text(x, y + 24, "start", fill=palette.INK, font_size=13, text_anchor="middle", class_="halo")


def _draw_failure(svg: Svg, at: SE2, view: _View) -> None:
    x, y = view(np.array([[at.x, at.y]]))[0]
    for colour, width in (("#ffffff", 7), (palette.FAILURE, 3.6)):
        for dx in (-8, 8):
            svg.line(x - dx, y - 8, x + dx, y + 8, stroke=colour, stroke_width=width, stroke_linecap="round")


def _draw_scale_bar(svg: Svg, scale: float, y: float) -> None:
    metres = next(length for length in (1, 2, 5, 10, 20, 50) if length * scale >= 90 or length == 50)
    end = 12 + metres * scale
    svg.line(12.0, y, end, y, stroke=palette.INK, stroke_width=1.6)
    for x in (12.0, end):
        svg.line(x, y - 4, x, y + 4, stroke=palette.INK, stroke_width=1.6)
    svg.text(end + 8, y + 4.5, f"{metres} m", fill=palette.INK, font_size=13)


def _ahead(x: float, y: float, theta: float, length: float) -> tuple[float, float]:
    """A point of the drawing so far ahead of (x, y), theta counter-clockwise as in `map`."""
    return x + length * math.cos(theta), y - length * math.sin(theta)
