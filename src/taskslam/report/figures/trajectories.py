"""Where the robot truly drove: every round of a run on the floor plan, with the waypoints and where goals failed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Affine2D

from taskslam.evaluation import RunMetrics
from taskslam.evaluation.metrics_file import PoseRow
from taskslam.geometry import FloatArray
from taskslam.record import RunRecord
from taskslam.report import palette
from taskslam.report.figures.lettering import draw_title
from taskslam.report.figures.style import WIDTHS, Width, add_axes, new_figure, printed
from taskslam.report.figures.tags import add_tags
from taskslam.report.floor import extent, floor_plan
from taskslam.report.simplify import simplified
from taskslam.report.tracks import Tracks
from taskslam.world import FloorPlan
from taskslam.world.floor_plan import FREE, OCCUPIED

_HEAD, _FOOT, _TALLEST = 0.32, 0.2, 6.5  # in: above and below the plan, and the most that it may take
_TOLERANCE = 0.15  # pt: what leaving points out may move a line by
_TRUTH: dict[str, Any] = {"color": palette.TRUTH, "linewidth": 0.7, "alpha": 0.75}
_PRIMING: dict[str, Any] = {"color": palette.MUTED, "linewidth": 0.7, "dashes": (3, 2)}
_TICK = 7.0  # pt: from a waypoint's middle ahead


@printed
def trajectory_figure(record: RunRecord, metrics: RunMetrics, title: str, width: Width) -> Figure:
    """Draw one run; without a floor plan on white, and a round without a recorded truth not at all."""
    plan, recorded = floor_plan(record.directory), Tracks(record)
    tracks = [(start.priming, recorded.get(start.round, "truth").poses) for start in record.rounds()]
    goals = np.array([waypoint.target[:2] for waypoint in metrics.waypoints])
    low, high = extent(plan, [goals, *(poses for _, poses in tracks)])
    size = high - low
    inches = WIDTHS[width]
    scale = min(inches / size[0], _TALLEST / size[1])  # inches a metre
    figure = new_figure(inches, _HEAD + scale * size[1] + _FOOT, constrained=False)
    axes = add_axes(figure, (inches - scale * size[0]) / 2, _HEAD, scale * size[0], scale * size[1])
    axes.set_axis_off()
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    if plan is not None:
        _draw_plan(axes, plan)
    for priming, poses in tracks:
        if len(poses) > 1:
            line = simplified(poses[:, :2], _TOLERANCE / 72 / scale)
            axes.plot(line[:, 0], line[:, 1], zorder=2, **(_PRIMING if priming else _TRUTH))
    tick = _TICK / 72 / scale
    _draw_waypoints(axes, record, metrics, tick)
    places = [failure.truth for failure in metrics.failures if failure.truth is not None]
    for edge, thick in (("white", 2.6), (palette.FAILURE, 1.4)):
        axes.plot([at[0] for at in places], [at[1] for at in places], "x", markersize=5.5, color=edge,
                  markeredgewidth=thick, zorder=5)  # fmt: skip
    _draw_words(figure, title, metrics, tracks, scale)
    tips = [(_ahead(waypoint.target, tick), "") for waypoint in metrics.waypoints]  # no number hides a heading
    add_tags(axes, [*((waypoint.target[:2], str(waypoint.goal + 1)) for waypoint in metrics.waypoints), *tips])
    return figure


def _draw_plan(axes: Axes, plan: FloorPlan) -> None:
    """Walls dark and what is unknown faint, turned as the plan's origin is."""
    shades = np.full(plan.cells.shape, 1, dtype=np.uint8)
    shades[plan.cells == FREE] = 0
    shades[plan.cells == OCCUPIED] = 2
    rows, columns = plan.cells.shape
    T_map_grid = Affine2D().rotate(plan.origin.theta).translate(plan.origin.x, plan.origin.y)
    image = axes.imshow(
        shades,
        cmap=ListedColormap(["#ffffff", palette.TRACK, "#404856"]),
        vmin=0,
        vmax=2,
        origin="lower",
        extent=(0, columns * plan.resolution, 0, rows * plan.resolution),
        interpolation="nearest",
        aspect="auto",
        zorder=0,
    )
    image.set_transform(T_map_grid + axes.transData)


def _draw_waypoints(axes: Axes, record: RunRecord, metrics: RunMetrics, tick: float) -> None:
    """Goals as dots with their headings, hollow where one was missed; the start as a triangle. tick: metres."""
    for waypoint in metrics.waypoints:
        x, y, _ = waypoint.target
        tip = _ahead(waypoint.target, tick)
        axes.plot([x, tip[0]], [y, tip[1]], color=palette.INK, linewidth=0.9, zorder=3)
        axes.plot(x, y, "o", markersize=4.2, markeredgewidth=0.9, markeredgecolor=palette.INK,
                  markerfacecolor=palette.INK if waypoint.complete else "white", zorder=4)  # fmt: skip
    start = record.manifest.start
    if start is not None:
        turn = math.degrees(start.theta) - 90
        axes.plot(start.x, start.y, marker=(3, 0, turn), markersize=6, color="white", markeredgecolor=palette.INK,
                  markeredgewidth=0.9, zorder=4)  # fmt: skip


def _draw_words(
    figure: Figure, title: str, metrics: RunMetrics, tracks: list[tuple[bool, FloatArray]], scale: float
) -> None:
    """Title and key above, scale bar below."""
    width, height = figure.get_size_inches()
    draw_title(figure, title)
    handles = [Line2D([], [], label="true path", **_TRUTH)] if any(
        len(poses) for _, poses in tracks) else []  # fmt: skip
    if any(priming and len(poses) for priming, poses in tracks):
        handles.append(Line2D([], [], label="priming round", **_PRIMING))
    dot: dict[str, Any] = {"color": palette.INK, "linestyle": "none", "marker": "o", "markersize": 4.2}
    handles.append(Line2D([], [], label="waypoint", **dot))
    if any(not waypoint.complete for waypoint in metrics.waypoints):
        handles.append(Line2D([], [], label="missed", markerfacecolor="white", **dot))
    if metrics.failures:
        handles.append(Line2D([], [], color=palette.FAILURE, linestyle="none", marker="x", markersize=5.5,
                              markeredgewidth=1.4, label="failure"))  # fmt: skip
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0, 1 - 0.14 / height), ncols=len(handles),
                  handlelength=1.3, columnspacing=0.9, handletextpad=0.3, borderaxespad=0.1)  # fmt: skip
    metres = next((length for length in (0.5, 1, 2, 5, 10, 20, 50) if length * scale >= 0.35), 100)
    bar = add_axes(figure, 0, height - _FOOT, width, _FOOT)
    bar.set_axis_off()
    bar.set_xlim(0, width)
    bar.set_ylim(0, _FOOT)
    bar.plot([0.04, 0.04 + metres * scale], [0.1, 0.1], color=palette.INK, linewidth=1.2, solid_capstyle="butt")
    bar.text(0.04 + metres * scale + 0.05, 0.1, f"{metres:g} m", va="center_baseline")


def _ahead(pose: PoseRow, distance: float) -> tuple[float, float]:
    """A point so many metres ahead of a pose."""
    x, y, theta = pose
    return x + distance * math.cos(theta), y + distance * math.sin(theta)
