"""From a setup to measured runs: look through the images, calibrate the stations, judge every arrival, write."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taskslam.errors import InputError
from taskslam.realworld.arrivals import ArrivalLog, read_arrivals
from taskslam.realworld.association import MeasuredArrival, Verdict, judge
from taskslam.realworld.cameras.camera_files import load_camera
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.clock_check import clock_offset
from taskslam.realworld.inside_out import bundle_station
from taskslam.realworld.looks import Look, image_frames, look_through
from taskslam.realworld.measured_file import FILE, ArrivalRow, MeasuredFile, PlaneRow, dump_measured
from taskslam.realworld.measured_run import Key, lost_arrivals, run_events, unjudged_goals, write_run
from taskslam.realworld.outside_in import overhead_station
from taskslam.realworld.overlay import picture
from taskslam.realworld.plane_calibration import ENOUGH_PLACES, PlaneCalibration
from taskslam.realworld.setup_file import CameraSource, InsideOutSetup, OutsideInSetup, Setup
from taskslam.realworld.sighting import Station
from taskslam.realworld.stillness import still_runs
from taskslam.realworld.tags.detector import Detector

Progress = Callable[[str, int, int], None]
"""Camera, images done, images in all."""


@dataclass(frozen=True)
class MeasuredRun:
    """What was written. counts: arrivals by verdict. unjudged: goals that left the denominators. notes: warnings."""

    directory: Path
    counts: Mapping[Verdict, int]
    unjudged: Mapping[int, str]
    arrivals: tuple[MeasuredArrival, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Rig:
    """All stations of a setup, how well their planes are known, and what is worth saying."""

    stations: tuple[Station, ...]
    sources: tuple[CameraSource, ...]
    planes: tuple[PlaneRow, ...]
    notes: tuple[str, ...]
    direction: str
    published: bool


def measure_outside_in(
    setup: OutsideInSetup,
    out: Path,
    published: bool = False,
    replace: bool = False,
    progress: Progress | None = None,
) -> list[MeasuredRun]:
    """Measure every run of a setup with cameras over the waypoints; run directories below `out`.

    published: by the published way, in the camera's own frame.

    Raises:
        InputError: a setup, log, calibration, image folder or clock that cannot be right, or a tag that no image shows.
        RecordError: there is such a run already and `replace` is not set.
    """
    logs = _logs(setup, {number for camera in setup.cameras for number in camera.waypoints})
    stations, planes, notes = [], [], []
    with Detector(setup.tag.family) as detector:
        for source in setup.cameras:
            camera, looks = _camera_looks(source, setup, detector, {setup.tag.id}, published, progress)
            station, plane = overhead_station(source, camera, looks, setup.tag, published)
            stations.append(station)
            notes += _broken(station.name, looks)
            if plane is not None:
                planes.append(_plane_row(source.name, plane))
                notes += _plane_notes(source.name, plane)
    _refuse_unseen(stations, {setup.tag.id})
    rig = _Rig(tuple(stations), setup.cameras, tuple(planes), tuple(notes), "outside-in", published)
    return _write_all(setup, logs, rig, out, replace)


def measure_inside_out(
    setup: InsideOutSetup,
    out: Path,
    published: bool = False,
    replace: bool = False,
    progress: Progress | None = None,
) -> list[MeasuredRun]:
    """Measure every run of a setup with a camera on the robot and tags over the waypoints; as `measure_outside_in`."""
    logs = _logs(setup, {number for bundle in setup.bundles for number in bundle.waypoints})
    ids = {tag.id for bundle in setup.bundles for tag in bundle.layout}
    with Detector(setup.bundles[0].family) as detector:
        camera, looks = _camera_looks(setup.camera, setup, detector, ids, published, progress)
    stations = [
        bundle_station(bundle, number - 1, setup.camera, camera, looks, published)
        for bundle in setup.bundles
        for number in bundle.waypoints
    ]
    _refuse_unseen(stations, ids)
    notes = [*_broken(f"camera {setup.camera.name}", looks)]
    single = sorted(number for bundle in setup.bundles if len(bundle.layout) == 1 for number in bundle.waypoints)
    if single and not published:
        named = ", ".join(str(number) for number in single)
        notes.append(
            f"waypoint {named}: one tag alone is measured as if the robot never tilted; 0.5 degrees of tilt move it by"
            " 0.9 % of the height of the tag above the camera (13 mm at 1.5 m). Hang four tags for a pose in space."
        )
    rig = _Rig(tuple(stations), (setup.camera,), (), tuple(notes), "inside-out", published)
    return _write_all(setup, logs, rig, out, replace)


def _logs(setup: Setup, watched: set[int]) -> list[ArrivalLog]:
    """The logs of all runs, read first: they are small, and what is wrong with them should not cost an hour."""
    logs = [read_arrivals(source, setup) for source in setup.runs]
    for log in logs:
        beyond = sorted(number for number in watched if number > len(log.goals))
        if beyond:
            raise InputError(
                f"the setup names waypoint {beyond[0]}; the run of {log.method} has {len(log.goals)}, counted from 1"
            )
    return logs


def _camera_looks(
    source: CameraSource,
    setup: Setup,
    detector: Detector,
    ids: set[int],
    published: bool,
    progress: Progress | None,
) -> tuple[Camera, list[Look]]:
    camera = load_camera(setup.path(source.calibration), source.image_kind)
    frames = image_frames(setup.path(source.images))
    report = None if progress is None else lambda done: progress(source.name, done, len(frames))
    return camera, look_through(frames, camera, detector, ids, 1.0 if published else source.gamma, report)


def _write_all(setup: Setup, logs: Sequence[ArrivalLog], rig: _Rig, out: Path, replace: bool) -> list[MeasuredRun]:
    seeds: Counter[tuple[str, str]] = Counter()
    judged = [_judge_run(setup, log, rig) for log in logs]
    runs = []
    for log, (measured, offsets, notes) in zip(logs, judged, strict=True):
        events = run_events(log, measured, setup.pause)
        unjudged = unjudged_goals(log, measured, [goal for station in rig.stations for goal in station.goals])
        said = (*notes, *_lost_notes(log, measured, unjudged))
        if len(unjudged) == len(log.goals):
            said = (*said, f"the run of {log.method} cannot be judged at any waypoint, so evaluation will refuse it")
        seed = log.record.manifest.seed if log.record is not None else seeds[log.method, log.mode]
        seeds[log.method, log.mode] += 1
        name = setup.scenario or (log.record.manifest.scenario_name if log.record is not None else "measured")
        directory = out / name / log.method / log.mode / f"seed{seed}"
        known = all(station.place is not None for station in rig.stations) and not rig.published
        files = _files(measured, offsets, rig, said)
        frame = "map" if known else "waypoint"
        write_run(directory, log, events, unjudged, frame, setup.scenario, seed, files, replace)
        counts = Counter(found.verdict for found in measured.values())
        runs.append(MeasuredRun(directory, counts, unjudged, tuple(measured.values()), said))
    return runs


def _judge_run(
    setup: Setup, log: ArrivalLog, rig: _Rig
) -> tuple[dict[Key, MeasuredArrival], dict[str, float], tuple[str, ...]]:
    """Every arrival at a goal with a station, the clock offsets, and all notes."""
    notes = list(rig.notes)
    offsets: dict[str, float] = {}
    for source in rig.sources:
        own = [(station, still_runs(station.looks)) for station in rig.stations if station.clock == source.name]
        offsets[source.name], said = clock_offset(source, own, log, setup.pause)
        notes += said
    stations = {goal: station for station in rig.stations for goal in station.goals}
    stamps = {id(station): [look.frame.stamp for look in station.looks] for station in rig.stations}
    measured = {}
    for arrival in log.arrivals:
        station = stations.get(arrival.goal)
        if station is not None:
            offset = offsets[station.clock]
            measured[arrival.round, arrival.goal] = judge(
                arrival, station, stamps[id(station)], offset, setup.pause, setup.frames
            )
    return measured, offsets, tuple(notes)


def _lost_notes(
    log: ArrivalLog, measured: Mapping[Key, MeasuredArrival], unjudged: Mapping[int, str]
) -> tuple[str, ...]:
    """Waypoints that are judged on fewer rounds than were driven."""
    return tuple(
        f"the run of {log.method}, waypoint {goal + 1}: judged without round {', '.join(map(str, lost))}, in which the"
        " images do not decide whether the robot was there"
        for goal, lost in sorted(lost_arrivals(log, measured).items())
        if goal not in unjudged
    )


def _files(
    measured: Mapping[Key, MeasuredArrival], offsets: Mapping[str, float], rig: _Rig, notes: Sequence[str]
) -> dict[str, bytes]:
    """The pictures and arrivals.json."""
    files: dict[str, bytes] = {}
    rows = []
    for (number, goal), found in sorted(measured.items()):
        name = None
        if found.look is not None:
            try:
                content = picture(found.station.looks[found.look], found.verdict is Verdict.MEASURED)
            except InputError:
                pass  # a broken image is named by the reason already
            else:
                name = f"waypoint{goal + 1:02d}_round{number:02d}.jpg"
                files[name] = content
        rows.append(_row(found, name))
    table = MeasuredFile(
        direction="outside-in" if rig.direction == "outside-in" else "inside-out",
        published=rig.published,
        clock_offsets=dict(offsets),
        planes=rig.planes,
        notes=tuple(notes),
        arrivals=tuple(rows),
    )
    return {**files, FILE: dump_measured(table)}


def _row(found: MeasuredArrival, name: str | None) -> ArrivalRow:
    sd = np.sqrt(np.diag(found.covariance)).tolist() if found.covariance is not None else None
    return ArrivalRow(
        round=found.arrival.round,
        goal=found.arrival.goal,
        priming=found.arrival.priming,
        station=found.station.name,
        verdict=found.verdict.value,
        reason=found.reason,
        image=found.image,
        picture=name,
        frames=found.frames,
        pose=(found.pose.x, found.pose.y, found.pose.theta) if found.pose is not None else None,
        sd=sd,
        residual_px=found.residual_px,
        margin_px=found.margin_px,
        spread_m=found.spread_m,
        other_heading=found.other_heading,
    )


def _plane_row(name: str, found: PlaneCalibration) -> PlaneRow:
    return PlaneRow(
        camera=name,
        tilt=float(np.degrees(found.plane.tilt)),
        height=-found.plane.height,
        sd_tilt=float(np.degrees(found.sd_tilt)),
        sd_height=found.sd_height,
        residual_px=found.residual_px,
        places=found.places,
    )


def _plane_notes(name: str, found: PlaneCalibration) -> list[str]:
    if found.well_spread:
        return []
    return [
        (
            f"camera {name}: the floor plane rests on {found.places} places at which the tag was seen,"
            f" {ENOUGH_PLACES} are better: its tilt is known to {np.degrees(found.sd_tilt):.2f} degrees, its height to"
            f" {1000 * found.sd_height:.1f} mm. Let the robot drive about under the camera once."
        )
    ]


def _broken(name: str, looks: Sequence[Look]) -> list[str]:
    broken = [look for look in looks if look.problem is not None]
    if not broken:
        return []
    return [f"{name}: {len(broken)} of {len(looks)} images could not be used; the first: {broken[0].problem}"]


def _refuse_unseen(stations: Sequence[Station], wanted: set[int]) -> None:
    """Images without any wanted tag are a wrong id, family or folder, and not a robot that never arrived."""
    if any(look.tags for station in stations for look in station.looks):
        return
    others = Counter(i for station in stations for look in station.looks for i in look.others)
    seen = ", ".join(f"{i} ({count} times)" for i, count in others.most_common(3)) or "no other tag either"
    count = sum(len(station.looks) for station in stations)
    ids = ", ".join(str(i) for i in sorted(wanted)[:8])
    raise InputError(f"none of {count} images shows tag {ids}; seen: {seen}. Check id, family and image folders.")
