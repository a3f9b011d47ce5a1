"""A run for the viewer rerun: every round on the clock of the run, with what the robot's eye saw now and then."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageColor

from taskslam.errors import InputError, RecordError
from taskslam.files import whole_file
from taskslam.geometry import SE2, FloatArray, wrap
from taskslam.lab.shot import jpeg
from taskslam.measurements import NANOSECONDS
from taskslam.record import Arrival, GoalFailed, GoalStarted, MethodNotice, RoundStarted, RunRecord
from taskslam.report import palette, words
from taskslam.report.floor import floor_plan
from taskslam.report.relived import Eye, instants, poses_of
from taskslam.world.floor_plan import OCCUPIED

SUFFIX = ".rrd"
_POSE_S, _PICTURE_S = 0.1, 1.0  # between two poses, and between two pictures
_WIDTH = 376  # px of a picture
_QUALITY = 75
_CLOCK = "run"


def shipped_viewer() -> Any:
    """The package rerun. Raises InputError if it is not installed."""
    try:
        return importlib.import_module("rerun")
    except ImportError as error:
        raise InputError("a recording for rerun needs its package: pip install 'taskslam[rerun]'") from error


def write_recording(record: RunRecord, eye: Eye | None, out: Path, wrote: Callable[[str], None]) -> None:
    """Write all rounds of a run; a file that stands there is replaced. wrote: hears what is under way.

    In `map`, metres: walls, goals, `robot` and `estimate` with their ways; as curves: what SLAM is off by, m and
    degrees, and the compute time of frames, ms; the journal as text; pictures of the eye where there is one.

    Raises InputError as `shipped_viewer`, or if no round has a true trajectory; DiskFullError.
    """
    rerun = shipped_viewer()
    manifest = record.manifest
    stream = rerun.RecordingStream("taskslam", recording_id=f"{manifest.method}-{manifest.mode}-{manifest.seed}")
    with whole_file(out) as temporary:
        stream.save(str(temporary))
        _draw_place(rerun, stream, record)
        for number, start in enumerate(record.rounds()):
            wrote(f"round {number + 1} of {len(record.rounds())}")
            _draw_round(rerun, stream, record, start, eye)
        _tell_journal(rerun, stream, record)
        stream.flush()
        stream.disconnect()


def _draw_place(rerun: Any, stream: Any, record: RunRecord) -> None:
    stream.log("map", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    plan = floor_plan(record.directory)
    if plan is not None:
        walls = plan.points_of(np.argwhere(plan.cells == OCCUPIED))
        stream.log(
            "map/walls", rerun.Points3D(_flat(walls), radii=plan.resolution / 2, colors=palette.WALL), static=True
        )
    goals = record.manifest.goals
    ahead = np.array([[0.3 * np.cos(goal.theta), 0.3 * np.sin(goal.theta), 0.0] for goal in goals])
    places = _flat(np.array([[goal.x, goal.y] for goal in goals]))
    labels = [str(number) for number in range(1, len(goals) + 1)]
    stream.log("map/goals", rerun.Arrows3D(origins=places, vectors=ahead, labels=labels), static=True)
    radius = record.manifest.robot_diameter / 2
    for name, colour in (("robot", palette.TRUTH), ("estimate", palette.BELIEF)):
        body = rerun.Ellipsoids3D(half_sizes=[[radius, radius, 0.1]], colors=[ImageColor.getrgb(colour)])
        stream.log(f"map/{name}", body, static=True)


def _draw_round(rerun: Any, stream: Any, record: RunRecord, start: RoundStarted, eye: Eye | None) -> None:
    stamps = instants(record, start, _POSE_S)
    truth, estimate = poses_of(record, start, stamps)
    for name, poses, colour in (("robot", truth, palette.TRUTH), ("estimate", estimate, palette.BELIEF)):
        known = np.isfinite(poses).all(axis=1)
        if known.any():
            half = poses[known, 2] / 2
            turns = np.column_stack([0 * half, 0 * half, np.sin(half), np.cos(half)])
            columns = rerun.Transform3D.columns(translation=_flat(poses[known]), quaternion=turns)
            stream.send_columns(f"map/{name}", indexes=[_clock(rerun, stamps[known])], columns=columns)
            way = rerun.LineStrips3D([_flat(poses[known])], colors=[ImageColor.getrgb(colour)])
            stream.set_time(_CLOCK, duration=start.t / NANOSECONDS)
            stream.log(f"map/{name}_way", way)
    both = np.isfinite(truth + estimate).all(axis=1)
    off = (truth - estimate)[both]
    _draw_curve(rerun, stream, "slam_off/metres", stamps[both], np.hypot(*off[:, :2].T))
    _draw_curve(rerun, stream, "slam_off/degrees", stamps[both], np.degrees(np.abs(wrap(off[:, 2]))))
    try:
        frames = record.frame_times(start.round)
    except RecordError:
        frames = None  # the report says it
    if frames is not None:
        _draw_curve(rerun, stream, "frame/compute_ms", frames.stamps, 1000 * frames.compute_s)
        _draw_curve(rerun, stream, "frame/latency_ms", frames.stamps, 1000 * frames.latency_s)
    if eye is not None:
        every = round(_PICTURE_S / _POSE_S)
        for stamp, pose in zip(stamps[::every].tolist(), truth[::every].tolist(), strict=True):
            picture = Image.fromarray(eye.picture(SE2(*pose)))
            small = picture.resize((_WIDTH, round(_WIDTH * picture.height / picture.width)))
            stream.set_time(_CLOCK, duration=stamp / NANOSECONDS)
            stream.log("eye", rerun.EncodedImage(contents=jpeg(np.asarray(small), _QUALITY), media_type="image/jpeg"))


def _draw_curve(rerun: Any, stream: Any, name: str, stamps: Any, values: FloatArray) -> None:
    if len(values):
        stream.send_columns(name, indexes=[_clock(rerun, stamps)], columns=rerun.Scalars.columns(scalars=values))


def _tell_journal(rerun: Any, stream: Any, record: RunRecord) -> None:
    for event in record.events:
        said, level = "", "INFO"
        if isinstance(event, GoalStarted):
            said = f"sets out for waypoint {event.goal + 1}"
        elif isinstance(event, Arrival):
            said = f"stands at waypoint {event.goal + 1}"
        elif isinstance(event, GoalFailed):
            said, level = f"waypoint {event.goal + 1}: {words.outcome(event.outcome.value)}: {event.detail}", "ERROR"
        elif isinstance(event, MethodNotice):
            said, level = event.text, "WARN"
        if said:
            stream.set_time(_CLOCK, duration=event.t / NANOSECONDS)
            stream.log("journal", rerun.TextLog(said, level=level))


def _clock(rerun: Any, stamps: Any) -> Any:
    return rerun.TimeColumn(_CLOCK, duration=np.asarray(stamps) / NANOSECONDS)


def _flat(points: FloatArray) -> FloatArray:
    """(N, 3) on the floor, of (N, 2) or more columns of which two are used."""
    return np.column_stack([points[:, :2], np.zeros(len(points))])
