"""Where a goal failed, closely: the floor plan around it, the path of the last seconds, and where SLAM was."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup

from taskslam.geometry import SE2, FloatArray
from taskslam.record import GoalFailed
from taskslam.report import palette
from taskslam.report.page.failure_story import Story
from taskslam.report.page.plan_drawing import PlanView, draw_failure, draw_plan, draw_scale_bar, draw_waypoint
from taskslam.report.simplify import simplified
from taskslam.report.svg import Svg
from taskslam.world import FloorPlan

_WIDTH, _HEIGHT, _FOOT = 400.0, 300.0, 30.0
_NEAR = 5.0  # m: the goal and the estimate are inside the picture if they are no further off
_LEAST = 1.4  # m: half of the shortest height shown
_MARGIN = 0.5  # m
_TOLERANCE = 0.4  # of the drawing's units, for thinning paths
_EDGE = 16.0  # how far an arrow to something outside keeps from the edge


def story_figure(plan: FloorPlan | None, failure: GoalFailed, story: Story, diameter_m: float) -> Markup | None:
    """Draw it; None if nobody knows where the robot was. diameter_m: the robot is drawn as a disc of that size."""
    where = failure.truth or failure.estimate
    if where is None:
        return None
    outside = {
        name: pose
        for name, pose in (("goal", failure.target), ("SLAM", failure.estimate))
        if pose is not None and pose.distance_to(where) > _NEAR
    }
    view = _view(where, failure, story, outside)
    svg = Svg(view.width, view.height + _FOOT, f"Where goal {failure.goal + 1} failed")
    with svg.window(view.width, view.height):
        svg.add("rect", width=view.width, height=view.height, fill=palette.TRACK)
        if plan is not None:
            draw_plan(svg, plan, view)
        joined = {"stroke_linejoin": "round", "stroke_linecap": "round"}
        _draw_path(svg, story.believed, view, stroke=palette.BELIEF, stroke_width=6, stroke_opacity=0.5, **joined)
        _draw_path(svg, story.path, view, stroke=palette.TRUTH, stroke_width=2.2, **joined)
        if "goal" not in outside:
            draw_waypoint(svg, failure.target, str(failure.goal + 1), True, view)
        if failure.truth is not None:
            _draw_robot(svg, failure.truth, diameter_m, palette.TRUTH, view)
        if failure.estimate is not None and "SLAM" not in outside:
            _draw_robot(svg, failure.estimate, diameter_m, palette.BELIEF, view)
        draw_failure(svg, where, view)
        for row, (name, pose) in enumerate(outside.items()):
            _draw_arrow_out(svg, name, pose, where, view, row)
        svg.add("rect", width=view.width, height=view.height, fill="none", stroke=palette.HAIRLINE, stroke_width=2)
    draw_scale_bar(svg, view.scale, view.height + 17)
    return svg.markup()


def _view(where: SE2, failure: GoalFailed, story: Story, outside: dict[str, SE2]) -> PlanView:
    """The smallest window of the picture's proportions that shows what is near."""
    shown = [where]
    if "goal" not in outside:
        shown.append(failure.target)
    if failure.estimate is not None and "SLAM" not in outside:
        shown.append(failure.estimate)
    points = np.array([[pose.x, pose.y] for pose in shown])
    path = np.concatenate([story.path[:, :2], story.believed[:, :2]])
    near = path[np.hypot(*(path - [where.x, where.y]).T) <= _NEAR] if len(path) else path
    points = np.concatenate([points, near])
    low, high = points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN
    centre, half = (low + high) / 2, (high - low) / 2
    half_height = max(float(half[1]), float(half[0]) * _HEIGHT / _WIDTH, _LEAST)
    scale = _HEIGHT / 2 / half_height
    return PlanView(float(centre[0] - _WIDTH / 2 / scale), float(centre[1] + half_height), scale, _WIDTH, _HEIGHT)


def _draw_path(svg: Svg, poses: FloatArray, view: PlanView, **ink: object) -> None:
    if len(poses) > 1:
        svg.polyline(simplified(view(poses), _TOLERANCE), **ink)


def _draw_robot(svg: Svg, pose: SE2, diameter_m: float, colour: str, view: PlanView) -> None:
    """A disc of the robot's size with a line ahead."""
    x, y = view(np.array([[pose.x, pose.y]]))[0]
    radius = diameter_m / 2 * view.scale
    svg.circle(float(x), float(y), radius, fill=colour, fill_opacity=0.15, stroke=colour, stroke_width=1.8)
    svg.line(x, y, x + radius * math.cos(pose.theta), y - radius * math.sin(pose.theta), stroke=colour, stroke_width=2)


def _draw_arrow_out(svg: Svg, name: str, pose: SE2, where: SE2, view: PlanView, row: int) -> None:
    """An arrow towards something that lies outside the picture, and how far off it is."""
    colour = palette.BELIEF if name == "SLAM" else palette.INK
    x, y = view(np.array([[where.x, where.y]]))[0]
    turn = math.atan2(pose.y - where.y, pose.x - where.x)
    reach = min(_to_edge(float(x), math.cos(turn), _WIDTH), _to_edge(float(y), -math.sin(turn), _HEIGHT), 90.0)
    tip = (x + reach * math.cos(turn), y - reach * math.sin(turn))
    start = (x + 18 * math.cos(turn), y - 18 * math.sin(turn))
    svg.line(*start, *tip, stroke=colour, stroke_width=2.2, stroke_dasharray="5 3")
    head = [(tip[0] + 9 * math.cos(turn + side), tip[1] - 9 * math.sin(turn + side)) for side in (2.6, -2.6)]
    svg.polyline(np.array([head[0], tip, head[1]]), stroke=colour, stroke_width=2.2, stroke_linejoin="round")
    far = f"{pose.distance_to(where):.1f} m"
    text = f"SLAM puts the robot {far} that way" if name == "SLAM" else f"the goal lies {far} that way"
    svg.text(10, 22 + 19 * row, text, fill=palette.INK, font_size=13.5, font_weight=600, class_="halo")


def _to_edge(at: float, along: float, length: float) -> float:
    """How far one can go from `at` in one direction before the edge of the picture is near."""
    if abs(along) < 1e-9:
        return math.inf
    return max(((length - _EDGE - at) if along > 0 else (at - _EDGE)) / abs(along), 24.0)
