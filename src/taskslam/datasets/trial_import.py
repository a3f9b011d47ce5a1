"""Trials in the published layout become run directories (protocol 1.4, 1.6, 5.1).

    FOLDER/.../ENVIRONMENT/METHOD/PATH/trial<k>

A run is one method on one path in one mode. without-map: its rounds are the trials. with-map: its rounds are the loops
of the first trial, of which loop 0 only primes the map (D0.3). M is given, never counted from what is there: a round
that is missing counts as missed, and what is there beyond M is left out and counted (7.3 #17).
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from taskslam.datasets.published_trials import Trial, is_trial, read_goals, read_trial
from taskslam.errors import DatasetError, RecordError
from taskslam.geometry import SE2, FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.mode import Mode
from taskslam.outcomes import Outcome
from taskslam.record import (
    Arrival,
    GoalFailed,
    Manifest,
    MethodNotice,
    PoseName,
    RoundEnded,
    RoundStarted,
    RunEnded,
    RunWriter,
    Trajectory,
)

_MODE_FOLDERS = {"slam": Mode.WITHOUT_MAP, "mapping": Mode.WITHOUT_MAP, "localization": Mode.WITH_MAP}
_NOT_SAID = "not among the visited waypoints; the published files do not say why"


@dataclass(frozen=True)
class Imported:
    """One run that was made. missing: counts, by a sentence for what was missing or left out."""

    directory: Path
    name: str
    arrivals: int
    planned: int
    missing: Counter[str]


@dataclass
class ImportResult:
    """All runs, and the sets of trials that could not become one, with the reason."""

    runs: list[Imported] = field(default_factory=list)
    left_out: dict[Path, str] = field(default_factory=dict)


def import_trials(
    folder: Path, out: Path, rounds: int = 5, mode: Mode | None = None, overwrite: bool = False
) -> ImportResult:
    """Import all trials at or below `folder` into `out`, as OUT/environment_path/method/mode/seed0.

    mode: None to tell it from the name of ENVIRONMENT's folder (slam, mapping, localization) or from the loops that
    were driven. A set of trials that cannot be read is left out with its reason.

    Raises DatasetError if there is no trial at all; DiskFullError.
    """
    trials = [Path(place) for place, _, _ in os.walk(folder) if is_trial(Path(place))]
    if not trials:
        raise DatasetError(
            f"{folder}: holds no trial; expected folders ENVIRONMENT/METHOD/PATH/trial<k> with planned_waypoints.txt"
        )
    groups: dict[Path, list[Path]] = {}
    for trial in sorted(trials, key=_trial_order):
        groups.setdefault(trial.resolve().parent, []).append(trial)
    result = ImportResult()
    for group in sorted(groups):
        try:
            result.runs.append(_import_run(groups[group], group, out, rounds, mode, overwrite))
        except (DatasetError, RecordError) as error:
            result.left_out[group] = str(error)
    return result


@dataclass(frozen=True)
class _Round:
    """One round: a loop of a trial, and its window of time (ns)."""

    trial: Trial
    loop: int
    begin: int
    end: int


def _import_run(
    folders: list[Path], group: Path, out: Path, rounds: int, mode: Mode | None, overwrite: bool
) -> Imported:
    goals = _common_goals(folders)
    trials = [read_trial(folder, goals) for folder in folders]
    loops = max((visit.loop for trial in trials for visit in trial.visits), default=0)
    if len(group.parts) < 4:
        raise DatasetError(f"{group}: expected trials in folders ENVIRONMENT/METHOD/PATH/trial<k>")
    environment, method, path = (_plain(part) for part in group.parts[-3:])
    mode = mode or _MODE_FOLDERS.get(Path(*group.parts[:-3]).name) or (Mode.WITH_MAP if loops else Mode.WITHOUT_MAP)
    missing: Counter[str] = Counter()
    chosen = list(
        _rounds_without_map(trials, rounds, missing) if mode is Mode.WITHOUT_MAP else _loops(trials, rounds, missing)
    )
    for trial in {id(one.trial): one.trial for one in chosen}.values():
        missing.update(trial.missing)
    scenario = f"{environment}_{path}"
    directory = out / scenario / method / mode / "seed0"
    with RunWriter(directory, replace=overwrite) as record:
        arrivals, now = _write_rounds(record, chosen, goals, mode, missing)
        planned = len(goals) * rounds
        record.event(RunEnded(now, arrivals == planned))
        content = _scenario(scenario, goals, trials[0], missing)
        record.finish(
            Manifest(
                source="import",
                scenario_name=scenario,
                scenario=content,
                scenario_hash=hashlib.sha256(json.dumps(content["sequence"], sort_keys=True).encode()).hexdigest(),
                method=method,
                method_card={},
                mode=mode,
                seed=0,
                rounds=rounds,
                latency="as driven",
                started_utc=datetime.fromtimestamp(folders[0].stat().st_mtime, UTC).isoformat(),
                wall_s=now / NANOSECONDS,
                simulated_s=now / NANOSECONDS,
                complete=arrivals == planned,
                failure=None if arrivals == planned else f"{planned - arrivals} of {planned} arrivals are missing",
            )
        )
    return Imported(directory, f"{scenario} / {method} / {mode}", arrivals, planned, +missing)


def _rounds_without_map(trials: list[Trial], rounds: int, missing: Counter[str]) -> Iterator[_Round]:
    missing["trials that are not there"] += max(0, rounds - len(trials))
    missing["trials left out: more than the rounds that count"] += max(0, len(trials) - rounds)
    for trial in trials[:rounds]:
        later = sum(visit.loop > 0 for visit in trial.visits)
        missing["visits left out: in a second loop of a round without map"] += later
        yield _Round(trial, 0, *_span(trial))


def _loops(trials: list[Trial], rounds: int, missing: Counter[str]) -> Iterator[_Round]:
    trial, (begin, end) = trials[0], _span(trials[0])
    missing["trials left out: with-map rounds are the loops of the first one"] += len(trials) - 1
    last = max((visit.loop for visit in trial.visits), default=-1)
    missing["loops that are not there"] += max(0, rounds - max(last, 0))
    missing["loops left out: more than the rounds that count"] += max(0, last - rounds)
    for loop in range(min(last, rounds) + 1):
        until = max((visit.stamp for visit in trial.visits if visit.loop <= loop), default=begin)
        until = end if loop == last else until
        yield _Round(trial, loop, begin, until)
        begin = until + 1


def _span(trial: Trial) -> tuple[int, int]:
    """First and last instant (ns) that a trial tells of."""
    stamps = [visit.stamp for visit in trial.visits]
    for trajectory in (trial.truth, trial.odometry):
        stamps += [int(trajectory.stamps[0]), int(trajectory.stamps[-1])] if len(trajectory) else []
    return (min(stamps), max(stamps)) if stamps else (0, 0)


def _write_rounds(
    record: RunWriter, rounds: list[_Round], goals: FloatArray, mode: Mode, missing: Counter[str]
) -> tuple[int, int]:
    """All events and trajectories; the arrivals in rounds that count, and the time of the run (ns) at the end."""
    arrivals = now = 0
    for number, one in enumerate(rounds):
        priming, began = mode is Mode.WITH_MAP and number == 0, now
        record.event(RoundStarted(now, number, priming))
        for text, count in sorted(one.trial.missing.items()) if one.loop == 0 else ():
            record.event(MethodNotice(now, number, f"{one.trial.folder.name}: {count} {text}"))
        visits = {visit.goal: visit for visit in one.trial.visits if visit.loop == one.loop}
        for visit in visits.values():
            truth = one.trial.true_pose_at(visit.stamp)
            missing["arrivals without a true pose within 0.05 s"] += truth is None
            at = began + max(0, visit.stamp - one.begin)
            record.event(Arrival(at, number, visit.goal, SE2(*goals[visit.goal].tolist()), truth, None, None))
        now = began + one.end - one.begin
        for goal in sorted(set(range(len(goals))) - visits.keys()):
            target = SE2(*goals[goal].tolist())
            record.event(GoalFailed(now, number, goal, target, Outcome.UNRECORDED, _NOT_SAID, None, None, None))
        _write_trajectories(record, number, one)
        outcome = Outcome.REACHED if len(visits) == len(goals) else Outcome.UNRECORDED
        record.event(RoundEnded(now, number, outcome, 0, 0))
        arrivals += 0 if priming else len(visits)
    return arrivals, now


def _write_trajectories(record: RunWriter, number: int, one: _Round) -> None:
    """Truth as it is; odometry laid on the first true pose of the trial."""
    truth, odometry = one.trial.truth, one.trial.odometry
    _write_window(record, "truth", number, one, truth, SE2())
    if len(truth) and len(odometry):
        begin = SE2(*odometry.poses[0].tolist())
        _write_window(record, "odometry", number, one, odometry, SE2(*truth.poses[0].tolist()) @ begin.inverse())


def _write_window(
    record: RunWriter, name: PoseName, number: int, one: _Round, trajectory: Trajectory, T_map_frame: SE2
) -> None:
    inside = (trajectory.stamps >= one.begin) & (trajectory.stamps <= one.end)
    for stamp, pose in zip(trajectory.stamps[inside].tolist(), trajectory.poses[inside].tolist(), strict=True):
        record.pose(name, number, stamp, T_map_frame @ SE2(*pose))


def _common_goals(folders: list[Path]) -> FloatArray:
    """The goals that all trials of a run share. Raises DatasetError if they differ, or if no trial has any."""
    known: tuple[Path, FloatArray] | None = None
    for folder in folders:
        goals = read_goals(folder)
        if not len(goals):
            continue
        if known is not None and not np.array_equal(goals, known[1]):
            raise DatasetError(f"{folder} and {known[0]} planned different goals; expected trials of one path")
        known = known or (folder, goals)
    if known is None:
        raise DatasetError(f"{folders[0].parent}: no trial has a planned_waypoints.txt, so its goals are not known")
    return known[1]


def _scenario(name: str, goals: FloatArray, trial: Trial, missing: Counter[str]) -> dict[str, object]:
    waypoints = [{"x": x, "y": y, "theta": theta} for x, y, theta in goals.tolist()]
    content: dict[str, object] = {
        "title": f"{name} (imported)",
        "sequence": {"waypoints": waypoints, "path": None},
        "missing": dict(sorted((+missing).items())),
    }
    if len(trial.truth):
        x, y, theta = trial.truth.poses[0].tolist()
        content["start"] = {"x": x, "y": y, "theta": theta}
    return content


def _trial_order(folder: Path) -> tuple[str, int, str]:
    number = re.search(r"\d+", folder.name)
    return str(folder.parent), int(number[0]) if number else 0, folder.name


def _plain(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name) or "unnamed"
