"""What cameras saw of a measured run: the picture of each arrival, and all arrivals at a waypoint over one another."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from taskslam.errors import RecordError
from taskslam.evaluation import RunMetrics, WaypointMetrics
from taskslam.geometry import SE2
from taskslam.reading import LARGEST_KEPT_PICTURE, read_bytes
from taskslam.realworld.measured_file import FOLDER, ArrivalRow, MeasuredFile, load_measured
from taskslam.record import RunRecord
from taskslam.report import palette
from taskslam.report.goal_frame import seen_from_goal
from taskslam.report.svg import Svg

_SIDE = 168.0
_REACH = 1.4  # robot diameters shown on each side at least


@dataclass(frozen=True)
class Photo:
    """One arrival. source: a data URI, empty without a picture. caption: when; note: how sure, or why not measured."""

    source: str
    caption: str
    verdict: str
    note: str


@dataclass(frozen=True)
class PhotoRow:
    """A waypoint that a camera or tags watch: all its arrivals over one another, and each one's picture."""

    goal: int
    unjudged: str | None
    overlay: Markup
    photos: tuple[Photo, ...]


@dataclass(frozen=True)
class MeasuredView:
    """All of it, and how it was measured."""

    file: MeasuredFile
    rows: tuple[PhotoRow, ...]


def measured_view(record: RunRecord, metrics: RunMetrics) -> MeasuredView | None:
    """The pictures of a run; None for a run that was not measured. Raises RecordError if its list is damaged."""
    file = load_measured(record)
    if file is None:
        return None
    rows = []
    for waypoint in metrics.waypoints:
        own = [row for row in file.arrivals if row.goal == waypoint.goal and not row.priming]
        photos = tuple(_photo(row, record.directory / FOLDER, metrics) for row in own)
        if photos:
            drawn = overlay_figure(waypoint, record.manifest.robot_diameter)
            rows.append(PhotoRow(waypoint.goal, waypoint.unjudged, drawn, photos))
    return MeasuredView(file, tuple(rows))


def _photo(row: ArrivalRow, folder: Path, metrics: RunMetrics) -> Photo:
    source = _data_uri(folder, row.picture)
    lost = "its picture is missing or damaged" if row.picture and not source else ""
    return Photo(
        source=source,
        caption=metrics.round_name(row.round).capitalize(),
        verdict=row.verdict,
        note="; ".join(filter(None, (row.reason or _sureness(row.sd, row.frames), lost))),
    )


def overlay_figure(waypoint: WaypointMetrics, diameter: float) -> Markup:
    """All arrivals over one another: the robot's outline dashed, an arrow for its heading (paper, real-world figure).

    The goal's heading points up; without a place in `map` that is the mean heading.
    """
    poses = [truth for _, truth, _ in seen_from_goal(waypoint) if truth is not None]
    svg = Svg(_SIDE, _SIDE, f"All arrivals at waypoint {waypoint.goal + 1}, robots of {100 * diameter:g} cm")
    svg.add("rect", width=_SIDE, height=_SIDE, rx=6, fill=palette.TRACK)
    if not poses:
        return svg.markup()
    x, y = _middle(poses)
    reach = max(max(abs(at.x - x), abs(at.y - y)) for at in poses) + diameter
    scale = _SIDE / 2 / max(reach, _REACH * diameter)
    for at in poses:
        left, top = _SIDE / 2 - (at.y - y) * scale, _SIDE / 2 - (at.x - x) * scale
        svg.circle(
            left, top, diameter / 2 * scale, fill="none", stroke=palette.INK, stroke_width=0.9, stroke_dasharray="3 2"
        )
    for at in poses:
        left, top = _SIDE / 2 - (at.y - y) * scale, _SIDE / 2 - (at.x - x) * scale
        length = 0.75 * diameter * scale
        tip = (left - length * math.sin(at.theta), top - length * math.cos(at.theta))
        svg.line(left, top, *tip, stroke=palette.MAGENTA, stroke_width=1.6)
        for side in (0.4, -0.4):
            back = (tip[0] + 7 * math.sin(at.theta + side), tip[1] + 7 * math.cos(at.theta + side))
            svg.line(*tip, *back, stroke=palette.MAGENTA, stroke_width=1.6, stroke_linecap="round")
    return svg.markup()


def _middle(poses: Sequence[SE2]) -> tuple[float, float]:
    return math.fsum(at.x for at in poses) / len(poses), math.fsum(at.y for at in poses) / len(poses)


def _sureness(sd: tuple[float, float, float] | None, frames: int) -> str:
    """How sure a measured pose is, from the corners alone."""
    if sd is None:
        return ""
    return f"±{1000 * math.hypot(sd[0], sd[1]):.1f} mm, {frames} images"


def _data_uri(folder: Path, name: str | None) -> str:
    """A kept picture inside the page; nothing if it is gone, strange, cut off or large."""
    if name is None or Path(name).name != name:
        return ""
    try:
        content = read_bytes(folder / name, "picture", RecordError, LARGEST_KEPT_PICTURE)
    except RecordError:
        return ""
    if (content[:2], content[-2:]) != (b"\xff\xd8", b"\xff\xd9"):  # a JPEG's two ends
        return ""
    return "data:image/jpeg;base64," + base64.b64encode(content).decode("ascii")
