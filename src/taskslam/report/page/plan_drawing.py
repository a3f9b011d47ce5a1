"""The floor plan as a drawing, and what stands on it in more than one figure."""

from __future__ import annotations

import base64
import hashlib
import io
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from PIL import Image

from taskslam.geometry import SE2, FloatArray, transform_points
from taskslam.report import palette
from taskslam.report.floor import extent
from taskslam.report.svg import Svg
from taskslam.world import FloorPlan
from taskslam.world.floor_plan import FREE, OCCUPIED

_WIDTH, _HEIGHT = 1000.0, 1100.0  # the most that the drawing may take
_ROUND = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, *(digit * 10**power for power in range(5) for digit in (1, 2, 5)))  # m
_FOOT = 34.0  # below the plan, for the scale bar


@dataclass(frozen=True)
class PlanView:
    """From `map` in metres to the drawing: x right, y up."""

    left: float
    top: float
    scale: float
    width: float
    height: float

    def __call__(self, points: FloatArray) -> FloatArray:
        """(N, 2) drawing coordinates of (N, 2) points in `map`."""
        return (np.asarray(points, dtype=np.float64)[:, :2] - [self.left, self.top]) * [self.scale, -self.scale]


def plan_view(
    plan: FloorPlan | None, points: Iterable[FloatArray], width: float = _WIDTH, height: float = _HEIGHT
) -> PlanView:
    """The view that shows the known floor and all of these (N, 2) points in `map`, with a margin.

    width, height: the most that the drawing may take.
    """
    low, high = extent(plan, points)
    size = high - low
    scale = float(min(width / size[0], height / size[1]))
    return PlanView(float(low[0]), float(high[1]), scale, float(size[0]) * scale, float(size[1]) * scale)


def begin_plan(plan: FloorPlan | None, view: PlanView, label: str, role: str = "img") -> Svg:
    """Begin a drawing with the floor plan, or white, and its scale bar below; role as in `Svg`."""
    svg = Svg(view.width, view.height + _FOOT, label, role=role)
    if plan is not None:
        draw_plan(svg, plan, view)
    draw_scale_bar(svg, view.scale, view.height + 18)
    return svg


def draw_waypoint(svg: Svg, target: SE2, label: str, complete: bool, view: PlanView, ink: str = palette.INK) -> None:
    """Draw a goal as a disc with its heading; hollow if it was missed at least once."""
    x, y = view(np.array([[target.x, target.y]]))[0]
    tip = _ahead(x, y, target.theta, 23)
    base = _ahead(x, y, target.theta, 11)
    left, right = _ahead(*tip, target.theta + 2.6, 7), _ahead(*tip, target.theta - 2.6, 7)
    svg.line(*base, *tip, stroke=ink, stroke_width=1.8)
    svg.polyline(np.array([left, tip, right]), stroke=ink, stroke_width=1.8, stroke_linejoin="round")
    fill = ink if complete else palette.PAPER
    svg.circle(x, y, 11, fill=fill, stroke=ink, stroke_width=1.8)
    svg.text(
        x, y + 4.3, label, fill=palette.PAPER if complete else ink, font_size=12, font_weight=600, text_anchor="middle"
    )


def draw_start(svg: Svg, start: SE2, view: PlanView) -> None:
    """Draw where the robot starts."""
    x, y = view(np.array([[start.x, start.y]]))[0]
    corners = np.array([_ahead(x, y, start.theta + turn, 10) for turn in (0, 2.4, -2.4, 0)])
    svg.polyline(corners, stroke=palette.INK, stroke_width=1.8, stroke_linejoin="round")
    svg.text(x, y + 24, "start", fill=palette.INK, font_size=13, text_anchor="middle", class_="halo")


def draw_failure(svg: Svg, at: SE2, view: PlanView) -> None:
    """Draw a cross where a goal failed."""
    x, y = view(np.array([[at.x, at.y]]))[0]
    for colour, width in ((palette.PAPER, 7), (palette.FAILURE, 3.6)):
        for dx in (-8, 8):
            svg.line(x - dx, y - 8, x + dx, y + 8, stroke=colour, stroke_width=width, stroke_linecap="round")


def draw_plan(svg: Svg, plan: FloorPlan, view: PlanView) -> None:
    """Draw a floor plan by reference to its picture, which `plan_pictures` puts on the page once."""
    rows = plan.cells.shape[0]
    # Pixel (0, 0) of the picture is the top left of the grid, so columns run along x and rows against y.
    corner, along, down = view(
        transform_points(plan.origin, np.array([[0, rows], [1, rows], [0, rows - 1]]) * plan.resolution)
    )
    a, b = along - corner
    c, d = down - corner
    matrix = " ".join(f"{value:.6f}" for value in (a, b, c, d, *corner))
    svg.add("use", href=f"#{plan_key(plan)}", transform=f"matrix({matrix})")


def plan_pictures(plans: Iterable[FloorPlan]) -> Markup:
    """Every floor plan once, drawn nowhere: the figures of a page refer to it. One pixel is one unit of a drawing."""
    svg = Svg(0, 0, "Floor plans", kind="shared")
    for key, plan in {plan_key(plan): plan for plan in plans}.items():
        rows, columns = plan.cells.shape
        svg.add("image", id=key, href=_picture(plan), width=columns, height=rows, preserveAspectRatio="none",
                class_="plan")  # fmt: skip
    return svg.markup()


def plan_key(plan: FloorPlan) -> str:
    """The name of a plan's picture on the page: the same cells have the same name."""
    shape = np.array(plan.cells.shape, dtype=np.int64)
    return "plan-" + hashlib.sha256(shape.tobytes() + np.ascontiguousarray(plan.cells).tobytes()).hexdigest()[:12]


def _picture(plan: FloorPlan) -> str:
    """The plan as a PNG of three colours in a data URI; what is unknown is transparent."""
    pixels = np.full(plan.cells.shape, 2, dtype=np.uint8)
    for value, index in ((FREE, 0), (OCCUPIED, 1)):
        pixels[plan.cells == value] = index
    image = Image.fromarray(np.ascontiguousarray(pixels[::-1])).convert("P")
    image.putpalette([*palette.FREE, *palette.WALL, 255, 255, 255])
    buffer = io.BytesIO()
    image.save(buffer, format="PNG", optimize=True, bits=2, transparency=2)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def draw_scale_bar(svg: Svg, scale: float, y: float) -> None:
    """Draw a round number of metres at the left. scale: drawing units in a metre."""
    metres = next(length for length in _ROUND if length * scale >= 90 or length == _ROUND[-1])
    end = 12 + metres * scale
    svg.line(12.0, y, end, y, stroke=palette.INK, stroke_width=1.6)
    for x in (12.0, end):
        svg.line(x, y - 4, x, y + 4, stroke=palette.INK, stroke_width=1.6)
    svg.text(end + 8, y + 4.5, f"{metres} m", fill=palette.INK, font_size=13)


def _ahead(x: float, y: float, theta: float, length: float) -> tuple[float, float]:
    """A point of the drawing so far ahead of (x, y), theta counter-clockwise as in `map`."""
    return x + length * math.cos(theta), y - length * math.sin(theta)
