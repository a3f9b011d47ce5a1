"""Arrivals as the navigation side logged them: our journal, the published text files, or a CSV.

Times are integer nanoseconds since 1970 (UTC) by the robot's clock; an arrival is stamped at the end of the pause.
Which waypoint an arrival belongs to is read from the log or from its planned coordinates, never from the order of the
visits (protocol 5.9 e).
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from taskslam.errors import InputError
from taskslam.geometry import SE2, FloatArray, wrap_angle
from taskslam.measurements import NANOSECONDS
from taskslam.mode import Mode
from taskslam.reading import LARGEST_LOG, is_folder, is_there, read_text
from taskslam.realworld.setup_file import RunSource, Setup
from taskslam.record import Arrival, Manifest, RoundStarted, RunRecord, load_run
from taskslam.record.run_directory import MANIFEST
from taskslam.task import MOST_ROUNDS

_LATEST = 1e10  # s since 1970
_SAME_PLACE = 1e-3  # m and rad; the published files carry six decimals


@dataclass(frozen=True, slots=True)
class LoggedArrival:
    """The robot said that it stood at `goal` (from 0). stamp: ns UTC. round: from 0, priming rounds included."""

    stamp: int
    round: int
    goal: int
    priming: bool


@dataclass(frozen=True)
class ArrivalLog:
    """All arrivals of one run in time order, and what else is known of it.

    record: the run directory they come from, None for files. rounds: M, as planned. zero: ns UTC of t = 0
    of the journal; of files, the beginning of the first pause.
    """

    arrivals: tuple[LoggedArrival, ...]
    goals: tuple[SE2, ...]
    method: str
    mode: str
    rounds: int
    zero: int
    record: RunRecord | None


def read_arrivals(source: RunSource, setup: Setup) -> ArrivalLog:
    """The arrivals of one run of the setup.

    Raises:
        InputError: a log that cannot be read, holds no arrival, or lacks the method, mode or waypoints.
        RecordError: a damaged run directory.
    """
    first = setup.path(source.arrivals[0])
    if is_folder(first) and is_there(first / MANIFEST):
        if len(source.arrivals) > 1:
            raise InputError(f"{first}: a run directory holds all its rounds; expected it alone")
        return log_of_run(first, source.method, source.time_zero)
    return _from_files([setup.path(name) for name in source.arrivals], source, setup)


def log_of_run(directory: Path, method: str | None = None, time_zero: float | None = None) -> ArrivalLog:
    """The arrivals of a run directory. method: its name, instead of the run's; time_zero: s since 1970 of its t = 0.

    Raises InputError where it holds no arrival, RecordError where it is damaged.
    """
    record = load_run(directory)
    manifest = record.manifest
    zero = round(time_zero * NANOSECONDS) if time_zero is not None else _started(manifest, directory)
    priming = {event.round: event.priming for event in record.events if isinstance(event, RoundStarted)}
    arrivals = tuple(
        LoggedArrival(zero + event.t, event.round, event.goal, priming.get(event.round, False))
        for event in record.events
        if isinstance(event, Arrival)
    )
    if not arrivals:
        raise InputError(f"{directory}: the journal holds no arrival; there is nothing to measure")
    return ArrivalLog(arrivals, manifest.goals, method or manifest.method, manifest.mode, manifest.rounds, zero, record)


def _started(manifest: Manifest, directory: Path) -> int:
    try:
        return _utc(manifest.started_utc)
    except ValueError as error:
        raise InputError(f"{directory}: started_utc: {error}; give `time_zero` for this run") from None


def _from_files(paths: Sequence[Path], source: RunSource, setup: Setup) -> ArrivalLog:
    if source.method is None or source.mode is None:
        raise InputError(f"{paths[0]}: arrivals in a file do not say how they came about; give `method` and `mode`")
    goals = _goals(paths[0], setup)
    visits: list[tuple[int, int, int]] = []  # stamp, loop, goal
    for path in paths:
        read = _csv_visits if path.suffix == ".csv" else _published_visits
        found = read(path, goals)
        if not found:
            raise InputError(f"{path}: holds no arrival; expected at least one")
        first_loop = 0 if path.suffix == ".csv" else (max((visit[1] for visit in visits), default=-1) + 1)
        visits += [(stamp, loop + first_loop, goal) for stamp, loop, goal in found]
    priming = source.priming if source.priming is not None else source.mode is Mode.WITH_MAP
    if all(path.suffix == ".csv" for path in paths):
        priming = any(loop == 0 for _, loop, _ in visits)  # a CSV counts rounds from 1 and calls the priming round 0
        visits = [(stamp, loop - (not priming), goal) for stamp, loop, goal in visits]
    _refuse_twice(visits, paths)
    arrivals = tuple(LoggedArrival(stamp, loop, goal, priming and loop == 0) for stamp, loop, goal in sorted(visits))
    driven = max(arrival.round for arrival in arrivals) + 1 - priming
    rounds = source.rounds or driven
    if driven > rounds or rounds < 1:
        raise InputError(f"{paths[0]}: {driven} rounds that count; the setup says {rounds}")
    zero = arrivals[0].stamp - round(setup.pause * NANOSECONDS)
    return ArrivalLog(arrivals, goals, source.method, source.mode, rounds, zero, None)


def _goals(path: Path, setup: Setup) -> tuple[SE2, ...]:
    if setup.waypoints is not None:
        goals = tuple(place.pose for place in setup.waypoints)
    else:
        planned = path.with_name("planned_waypoints.txt")
        if not is_there(planned):
            raise InputError(f"{path}: give `waypoints`, for there is no {planned.name} beside it")
        goals = tuple(SE2(*row) for row in _table(planned, 3, "x y theta")[:, :3].tolist())
    if not goals:
        raise InputError(f"{path}: the list of waypoints is empty; expected at least one")
    return goals


def _published_visits(path: Path, goals: Sequence[SE2]) -> list[tuple[int, int, int]]:
    """`timestamp x y theta [wpt_index loop_index]` (protocol 1.6); without a loop index a goal met again starts one."""
    table = _table(path, 4, "timestamp x y theta")
    visits: list[tuple[int, int, int]] = []
    loop, met = 0, set[int]()
    for row in table.tolist():
        goal = _goal_at(SE2(*row[1:4]), goals, path)
        if not abs(row[0]) <= _LATEST or (len(row) >= 6 and not 0 <= row[5] <= MOST_ROUNDS):
            raise InputError(f"{path}: stamp {row[0]:g}: expected Unix seconds, and a loop of 0 to {MOST_ROUNDS}")
        if len(row) >= 6:
            loop = int(row[5])
        elif goal in met:
            loop, met = loop + 1, set()
        met.add(goal)
        visits.append((round(row[0] * NANOSECONDS), loop, goal))
    first = min((loop for _, loop, _ in visits), default=0)
    return [(stamp, loop - first, goal) for stamp, loop, goal in visits]


def _goal_at(at: SE2, goals: Sequence[SE2], path: Path) -> int:
    """Position and heading both: two goals may share a place and differ in heading."""
    for index, goal in enumerate(goals):
        if at.distance_to(goal) < _SAME_PLACE and abs(wrap_angle(at.theta - goal.theta)) < _SAME_PLACE:
            return index
    raise InputError(f"{path}: ({at.x:g}, {at.y:g}, {at.theta:g}) is none of the {len(goals)} waypoints")


def _csv_visits(path: Path, goals: Sequence[SE2]) -> list[tuple[int, int, int]]:
    rows = csv.DictReader(io.StringIO(_text(path)), skipinitialspace=True)
    try:
        missing = [name for name in ("time", "round", "waypoint") if name not in (rows.fieldnames or ())]
        if missing:
            raise InputError(f"{path}: no column {', '.join(missing)}; expected the header `time,round,waypoint`")
        return [_csv_visit(row, f"{path}, line {rows.line_num}", len(goals)) for row in rows]
    except csv.Error as error:
        raise InputError(f"{path}, line {rows.line_num}: {error}; expected `time,round,waypoint`") from None


def _csv_visit(row: Mapping[str, str], where: str, waypoints: int) -> tuple[int, int, int]:
    try:
        stamp, number, waypoint = _utc(row["time"] or ""), int(row["round"]), int(row["waypoint"])
    except (TypeError, ValueError) as error:
        raise InputError(f"{where}: {error}; expected a time, a round and a waypoint") from None
    if not 1 <= waypoint <= waypoints or not 0 <= number <= MOST_ROUNDS:
        raise InputError(
            f"{where}: waypoint {waypoint} in round {number}; expected waypoints 1 to {waypoints},"
            " rounds from 1 (0 is the priming round)"
        )
    return stamp, number, waypoint - 1


def _utc(text: str) -> int:
    """Ns since 1970 of Unix seconds, or of ISO 8601 with its zone. Raises ValueError."""
    text = text.strip()
    try:
        seconds, _, fraction = text.partition(".")
        if seconds.isdecimal() and (not fraction or fraction.isdecimal()) and int(seconds) <= _LATEST:
            return int(seconds) * NANOSECONDS + int(f"{fraction:0<9.9}")
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise ValueError(f"'{text}' is neither Unix seconds nor ISO 8601") from None
    if moment.tzinfo is None:
        raise ValueError(f"'{text}' names no time zone; expected e.g. {text}Z")
    whole = moment.replace(microsecond=0)
    return round(whole.timestamp()) * NANOSECONDS + moment.microsecond * 1000


def _table(path: Path, columns: int, names: str) -> FloatArray:
    rows: list[list[float]] = []
    for number, line in enumerate(_text(path).splitlines(), start=1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        try:
            values = [float(word) for word in text.replace(",", " ").split()]
        except ValueError:
            raise InputError(f"{path}, line {number}: expected `{names}`, found '{text[:80]}'") from None
        if len(values) < columns or not all(map(math.isfinite, values)) or (rows and len(values) != len(rows[0])):
            raise InputError(f"{path}, line {number}: expected finite numbers `{names}`, found '{text[:80]}'")
        rows.append(values)
    return np.array(rows, dtype=np.float64) if rows else np.empty((0, columns))


def _text(path: Path) -> str:
    return read_text(path, "log of arrivals", InputError, LARGEST_LOG)


def _refuse_twice(visits: Iterable[tuple[int, int, int]], paths: Sequence[Path]) -> None:
    seen = set[tuple[int, int]]()
    for _, loop, goal in visits:
        if (loop, goal) in seen:
            raise InputError(f"{paths[0]}: two arrivals at waypoint {goal + 1} in one round; expected one")
        seen.add((loop, goal))
