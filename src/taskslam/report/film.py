"""A round as a film: the world from above with the robot in it, beside what the robot's own eye sees."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageColor, ImageDraw, ImageFont

from taskslam.geometry import SE2, FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.record import Arrival, GoalFailed, GoalStarted, RoundStarted, RunRecord
from taskslam.report import palette, words
from taskslam.report.floor import extent, floor_plan
from taskslam.report.relived import Eye, Picture, Relived, instants, poses_of
from taskslam.simulation.rendering.world_pictures import Extent, top_down

_FINER = 2  # drawn so many times larger than shown, so that edges are smooth
_WAY_S = 30.0  # how much of the way lies behind the robot
_CUT = 2.0  # m above the floor: what stands higher is not seen from above
_BAR = 0.085  # of the height: the line above the pictures


@dataclass(frozen=True)
class FilmSettings:
    """height: of the two pictures, px; speed: times the robot's own; fps: frames a second of the film."""

    height: int = 480
    speed: float = 8.0
    fps: int = 30


class Film:
    """The frames of a round. size: width and height, px, both even; count: of the frames."""

    def __init__(self, relived: Relived, start: RoundStarted, name: str, settings: FilmSettings) -> None:
        """Look from above and light the scene. name: of the round. Raises InputError without a true trajectory."""
        record = relived.record
        self._record, self._start, self._name, self._settings = record, start, name, settings
        self._stamps = instants(record, start, settings.speed / settings.fps)
        self._truth, self._estimate = poses_of(record, start, self._stamps)
        self._diameter = record.manifest.robot_diameter
        self._above = _Above(relived, self._truth, settings.height)
        self._eye = Eye(relived) if relived.robot.rig.stereo is not None else None
        beside = 0 if self._eye is None else _even(settings.height * self._eye.size[0] / self._eye.size[1])
        self._bar = _even(settings.height * _BAR)
        self._widths = (self._above.width, beside)
        self.size = (sum(self._widths), settings.height + self._bar)
        self.count = len(self._stamps)

    def frames(self) -> Iterator[Picture]:
        """(H, W, 3) uint8, one after the other."""
        manifest = self._record.manifest
        title = f"{manifest.method} · {words.mode(manifest.mode)} · {self._name}"
        back = max(1, round(_WAY_S / self._settings.speed * self._settings.fps))
        for index, stamp in enumerate(self._stamps.tolist()):
            truth, estimate = _pose(self._truth[index]), _pose(self._estimate[index])
            behind = slice(max(0, index - back), index + 1)
            story = _story(self._record, self._start, stamp)
            frame = Image.new("RGB", self.size, palette.PAPER)
            above = self._above.picture(truth, estimate, self._truth[behind], self._estimate[behind], story)
            frame.paste(above, (0, self._bar))
            if self._eye is not None and truth is not None:
                seen = Image.fromarray(self._eye.picture(truth))
                frame.paste(seen.resize((self._widths[1], self._settings.height)), (self._widths[0], self._bar))
            seconds = (stamp - self._start.t) / NANOSECONDS
            off = (
                "" if truth is None or estimate is None else f" · SLAM {words.length(truth.distance_to(estimate))} off"
            )
            self._write(frame, title, f"{story.text}{off} · {int(seconds // 60)}:{seconds % 60:04.1f}")
            yield np.asarray(frame)

    def _write(self, frame: Image.Image, left: str, right: str) -> None:
        brush, width = ImageDraw.Draw(frame), self.size[0]
        size = self._bar * 0.5
        needed = ImageFont.load_default(size).getlength(f"{left}    {right}")
        font = ImageFont.load_default(size * min(1.0, (width - self._bar * 0.6) / needed))
        middle, edge = self._bar / 2, self._bar * 0.3
        brush.text((edge, middle), left, fill=palette.INK, font=font, anchor="lm")
        brush.text((width - edge, middle), right, fill=palette.MUTED, font=font, anchor="rm")


@dataclass(frozen=True)
class _Story:
    """What a moment is about. target: index of the goal that is driven to; failed: places of failures so far."""

    text: str
    target: int | None
    failed: tuple[SE2, ...]


def _story(record: RunRecord, start: RoundStarted, now: int) -> _Story:
    text, target, failed = "at the start", None, []
    for event in record.events:
        if getattr(event, "round", None) != start.round or event.t > now:
            continue
        if isinstance(event, GoalStarted):
            text, target = f"to waypoint {event.goal + 1}", event.goal
        elif isinstance(event, Arrival):
            text, target = f"at waypoint {event.goal + 1}", None
        elif isinstance(event, GoalFailed):
            text, target = f"waypoint {event.goal + 1} failed: {words.outcome(event.outcome.value)}", None
            failed += [where for where in (event.truth or event.estimate,) if where is not None]
    return _Story(text, target, tuple(failed))


class _Above:
    """The world from straight above, and what is drawn on it. width: px, even."""

    def __init__(self, relived: Relived, truth: FloatArray, height: int) -> None:
        record = relived.record
        self._goals = record.manifest.goals
        self._radius = record.manifest.robot_diameter / 2
        known = truth[np.isfinite(truth).all(axis=1)]
        places = np.array([[goal.x, goal.y] for goal in self._goals])
        low, high = extent(floor_plan(record.directory), [places, known])
        self.width = _even(height * float((high - low)[0] / (high - low)[1]))
        self._size = (self.width, height)
        self._left, self._top = float(low[0]), float(high[1])
        self._scale = _FINER * height / float((high - low)[1])
        area = Extent(float(low[0]), float(high[0]), float(low[1]), float(high[1]))
        seen = Image.fromarray(top_down(relived.world, max(self._size), _CUT, area))
        self._ground = seen.resize((_FINER * self.width, _FINER * height))

    def picture(
        self, truth: SE2 | None, estimate: SE2 | None, way: FloatArray, believed: FloatArray, story: _Story
    ) -> Image.Image:
        """The moment: the ways behind both, goals, robot, estimate, failures."""
        image = self._ground.copy()
        brush = ImageDraw.Draw(image)
        thick = max(2.5, self._size[1] / 90 * _FINER / 2)
        for index, goal in enumerate(self._goals):
            colour = palette.BLUE if index == story.target else palette.INK
            x, y = self._place(goal)
            brush.circle((x, y), 3.0 * thick, fill=colour, outline=palette.PAPER, width=round(thick / 2))
            font = ImageFont.load_default(4.4 * thick)
            brush.text((x, y), str(index + 1), fill=palette.PAPER, font=font, anchor="mm")
        for poses, colour, wide in ((believed, palette.BELIEF, 1.8), (way, palette.TRUTH, 0.8)):
            self._draw_way(brush, poses, palette.PAPER, (wide + 0.6) * thick)  # floors have all colours
            self._draw_way(brush, poses, colour, wide * thick)
        for pose, colour in ((estimate, palette.BELIEF), (truth, palette.TRUTH)):
            if pose is not None:
                self._draw_robot(brush, pose, colour, thick)
        for where in story.failed:
            x, y = self._place(where)
            for side in (-5 * thick, 5 * thick):
                brush.line(
                    (x - side, y - 5 * thick, x + side, y + 5 * thick), fill=palette.FAILURE, width=round(2 * thick)
                )
        return image.reduce(_FINER)

    def _place(self, at: SE2) -> tuple[float, float]:
        return (at.x - self._left) * self._scale, (self._top - at.y) * self._scale

    def _draw_way(self, brush: ImageDraw.ImageDraw, poses: FloatArray, colour: str, width: float) -> None:
        known = np.flatnonzero(np.isfinite(poses).all(axis=1))
        for rows in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1):
            if len(rows) > 1:
                points = [self._place(SE2(*pose)) for pose in poses[rows].tolist()]
                brush.line(points, fill=colour, width=round(width), joint="curve")

    def _draw_robot(self, brush: ImageDraw.ImageDraw, pose: SE2, colour: str, thick: float) -> None:
        x, y = self._place(pose)
        radius = max(self._radius * self._scale, 3 * thick)
        light = tuple((value + 2 * 255) // 3 for value in ImageColor.getrgb(colour)[:3])
        brush.circle((x, y), radius, fill=light, outline=colour, width=round(thick))
        tip = (x + 1.4 * radius * math.cos(pose.theta), y - 1.4 * radius * math.sin(pose.theta))
        brush.line((x, y, *tip), fill=colour, width=round(1.4 * thick))


def _pose(row: FloatArray) -> SE2 | None:
    return SE2(*row.tolist()) if np.isfinite(row).all() else None


def _even(size: float) -> int:
    """Video codecs halve colours, and want even sides."""
    return max(2, 2 * round(size / 2))
