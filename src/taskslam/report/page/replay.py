"""What the page's script plays of a run: where the robot was, where SLAM put it, and what happened, in few bytes.

A track is read ten times a second, rounded to 1 mm and 1 mrad, and written as second differences, zigzag, in digits of
base 64 of which each holds five bits and whether another one follows: a robot that drives evenly takes one letter a
number. `replay.js` reads it back.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.printable import one_line
from taskslam.record import Arrival, Event, GoalFailed, GoalStarted, MethodNotice, RoundStarted, RunRecord
from taskslam.report import words
from taskslam.report.page.plan_drawing import PlanView, begin_plan, draw_start, draw_waypoint, plan_key, plan_view
from taskslam.report.page.shell import json_in_script
from taskslam.report.poses_over_time import poses_at
from taskslam.report.tracks import Tracks
from taskslam.robot import Lidar2D
from taskslam.world import FloorPlan

MOST_OF_A_RUN = 5_000_000  # bytes; a longer tour is read less often
MOST_OF_A_PAGE = 20_000_000  # bytes of all replays of a page; what no longer fits is named and left out
STEP = 1e-3  # m and rad
_RATES = (10.0, 5.0, 2.0, 1.0)  # Hz
_MOST_NOTICES = 100  # of a round
_DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"


@dataclass(frozen=True)
class Replay:
    """stage: the floor plan with the goals, on which the script draws; data: JSON for a script element.

    casts: whether there is a planar LiDAR, and a floor plan into which its scan can be cast.
    """

    stage: Markup
    data: Markup
    casts: bool

    @property
    def size(self) -> int:
        """Bytes on the page."""
        return len(self.stage.encode()) + len(self.data)


def replay_of(record: RunRecord, plan: FloorPlan | None, tracks: Tracks, names: Sequence[str]) -> Replay | None:
    """The replay of a run; None if no trajectory was recorded, or if even one pose a second takes too much.

    names: of the rounds begun, in their order.
    """
    starts = record.rounds()
    every = [tracks.get(start.round, name) for start in starts for name in ("truth", "estimate")]
    if not any(len(track) > 1 for track in every):
        return None
    goals = record.manifest.goals
    places = np.array([[goal.x, goal.y] for goal in goals])
    truths = [tracks.get(start.round, "truth").poses for start in starts]
    view = plan_view(plan, [places, *truths])
    stage = _stage(record, plan, view)
    facts = _facts(record, plan, view)
    casts = facts["plan"] is not None and facts["lidar"] is not None
    for rate in _RATES:
        rounds = [_round(record.events, start, name, tracks, rate) for start, name in zip(starts, names, strict=True)]
        replay = Replay(stage, json_in_script({**facts, "rate": rate, "rounds": rounds}), casts)
        if replay.size <= MOST_OF_A_RUN:
            return replay
    return None


def kept_on_page(replays: Sequence[Replay | None], most: int = MOST_OF_A_PAGE) -> list[Replay | None]:
    """These replays, without those that no longer fit on one page; the first ones stay."""
    left, kept = most, []
    for replay in replays:
        fits = replay is not None and replay.size <= left
        left -= replay.size if replay is not None and fits else 0
        kept.append(replay if fits else None)
    return kept


def _stage(record: RunRecord, plan: FloorPlan | None, view: PlanView) -> Markup:
    svg = begin_plan(plan, view, f"Floor plan with {len(record.manifest.goals)} waypoints, on which the tour is played")
    if record.manifest.start is not None:
        draw_start(svg, record.manifest.start, view)
    for number, goal in enumerate(record.manifest.goals, start=1):
        draw_waypoint(svg, goal, str(number), True, view)
    return svg.markup()


def _facts(record: RunRecord, plan: FloorPlan | None, view: PlanView) -> dict[str, Any]:
    """What the drawing must know beside the tracks. view: left, top, scale, width, height; lengths in metres."""
    manifest = record.manifest
    lidar = _lidar(manifest.robot)
    return {
        "view": [view.left, view.top, view.scale, view.width, view.height],
        "radius": manifest.robot_diameter / 2,
        "diameter": manifest.robot_diameter,
        "field": manifest.field_of_view,
        "step": STEP,
        "goals": [[goal.x, goal.y] for goal in manifest.goals],
        "plan": None
        if plan is None
        else {
            "picture": plan_key(plan),
            "resolution": plan.resolution,
            "origin": [plan.origin.x, plan.origin.y, plan.origin.theta],
        },
        "lidar": lidar
        and [*lidar.mount.xyz[:2], lidar.mount.rpy[2], lidar.angle_min, lidar.angle_max, lidar.range_max],
    }


def _lidar(robot: dict[str, Any] | None) -> Lidar2D | None:
    """The planar LiDAR of the robot as run.json describes it; None if there is none, or none that is understood."""
    rig = (robot or {}).get("rig")
    part = rig.get("lidar_2d") if isinstance(rig, dict) else None
    try:
        return None if part is None else Lidar2D.model_validate(part)
    except ValueError:
        return None


def _round(events: Sequence[Event], start: RoundStarted, name: str, tracks: Tracks, rate: float) -> dict[str, Any]:
    own = [event for event in events if getattr(event, "round", None) == start.round]
    truth, estimate = tracks.get(start.round, "truth"), tracks.get(start.round, "estimate")
    end = max([event.t for event in own] + [int(track.stamps[-1]) for track in (truth, estimate) if len(track)])
    count = math.floor((end - start.t) / NANOSECONDS * rate) + 1
    stamps = start.t + (np.arange(count) / rate * NANOSECONDS).round().astype(np.int64)
    return {
        "name": name,
        "count": count,
        "truth": coded(poses_at(truth, stamps)),
        "estimate": coded(poses_at(estimate, stamps)),
        "events": list(_events(own, start.t)),
    }


def _events(own: Sequence[Event], began: int) -> Iterator[list[Any]]:
    """[seconds of the round, kind, waypoint from 1 or null, words, x, y]: a failure stands where the robot was."""
    notices = 0
    for event in own:
        at = round((event.t - began) / NANOSECONDS, 2)
        if isinstance(event, GoalStarted):
            yield [at, "goal", event.goal + 1, "", None, None]
        elif isinstance(event, Arrival):
            yield [at, "arrival", event.goal + 1, "", None, None]
        elif isinstance(event, GoalFailed):
            where = event.truth or event.estimate
            place = [None, None] if where is None else [round(where.x, 3), round(where.y, 3)]
            yield [at, "failure", event.goal + 1, one_line(words.outcome(event.outcome.value)), *place]
        elif isinstance(event, MethodNotice) and " -> " in event.text and notices < _MOST_NOTICES:
            notices += 1
            yield [at, "notice", None, one_line(event.text.replace("->", "→")), None, None]


def coded(poses: FloatArray) -> list[list[Any]]:
    """[[first, count, code], ...]: the stretches of (N, 3) poses that are known, NaN being what is not."""
    known = np.flatnonzero(np.isfinite(poses).all(axis=1))
    stretches = np.split(known, np.flatnonzero(np.diff(known) > 1) + 1)
    return [[int(rows[0]), len(rows), _code(poses[rows])] for rows in stretches if len(rows)]


def _code(poses: FloatArray) -> str:
    steps = np.column_stack([poses[:, :2], np.unwrap(poses[:, 2])]) / STEP
    whole = steps.round().astype(np.int64)
    second = np.diff(np.vstack([np.zeros((2, 3), np.int64), whole]), n=2, axis=0)
    zigzag = np.where(second < 0, -2 * second - 1, 2 * second)
    return "".join(_digits(number) for number in zigzag.ravel().tolist())


def _digits(number: int) -> str:
    letters = ""
    while number > 31:
        letters += _DIGITS[32 | number & 31]
        number >>= 5
    return letters + _DIGITS[number]
