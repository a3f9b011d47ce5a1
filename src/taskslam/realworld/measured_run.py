"""A measured run: the log of the navigation side with measured poses for truth, as any other run directory.

A pose is kept in `map` where the station's place in it is known. Else only the poses at one waypoint compare with one
another: the frame is then moved as a whole, so that their mean lies on the goal, for figures to have a place for them;
`truth_frame` in run.json says so, and accuracy is not defined. The poses as measured are in measured/arrivals.json.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from taskslam.evaluation.missing import FEWEST
from taskslam.files import writing
from taskslam.geometry import SE2, mean_heading
from taskslam.measurements import NANOSECONDS
from taskslam.outcomes import Outcome
from taskslam.realworld.arrivals import ArrivalLog, LoggedArrival
from taskslam.realworld.association import MeasuredArrival, Verdict
from taskslam.record import (
    Arrival,
    DrivenBy,
    Event,
    GoalFailed,
    GoalSkipped,
    Manifest,
    RoundEnded,
    RoundStarted,
    RunEnded,
    RunWriter,
)
from taskslam.version import __version__

Key = tuple[int, int]
"""Round and goal."""


def run_events(log: ArrivalLog, measured: Mapping[Key, MeasuredArrival], pause: float) -> list[Event]:
    """The journal of the measured run.

    measured: by round and goal, where the goal has a station. A measured arrival carries its pose as truth, one that
    was not seen is a failed goal, any other has no truth.
    """
    truths = _truths(log, measured)
    events: list[Event] = []
    for event in log.record.events if log.record is not None else _events_of_files(log, pause):
        if isinstance(event, Arrival):
            found = measured.get((event.round, event.goal))
            if found is not None and found.verdict is Verdict.NOT_SEEN:
                events += _not_seen(event, found.reason)
                continue
            truth = truths.get((event.round, event.goal))
            events.append(
                Arrival(event.t, event.round, event.goal, event.target, truth, event.estimate, event.odometry)
            )
        elif isinstance(event, GoalFailed):
            at = (event.t, event.round, event.goal, event.target, event.outcome, event.detail)
            events.append(GoalFailed(*at, None, event.estimate, event.odometry))
        elif isinstance(event, RunEnded):
            lost = any(found.verdict is Verdict.NOT_SEEN for found in measured.values())
            events.append(RunEnded(event.t, event.complete and not lost))
        else:
            events.append(event)
    return events


def unjudged_goals(log: ArrivalLog, measured: Mapping[Key, MeasuredArrival], watched: Sequence[int]) -> dict[int, str]:
    """Goals that leave the denominators: those without a station, and those at which too few images decide.

    An ambiguous arrival is missing data: its waypoint is judged by the other rounds, as long as two were measured. One
    that the robot missed in any round is incomplete, whatever the images of the others say.
    """
    reasons = {goal: "no camera or tag watches it" for goal in range(len(log.goals)) if goal not in watched}
    for goal, lost in lost_arrivals(log, measured).items():
        counted = [found for found in _counted(measured) if found.arrival.goal == goal]
        seen = sum(found.verdict is Verdict.MEASURED for found in counted)
        reached = all(found.verdict is not Verdict.NOT_SEEN for found in counted) and len(counted) == log.rounds
        if reached and seen < FEWEST:
            number, reason = next(iter(lost.items()))
            reasons[goal] = f"{seen} of {log.rounds} rounds measured; round {number} is ambiguous: {reason}"
    return dict(sorted(reasons.items()))


def lost_arrivals(log: ArrivalLog, measured: Mapping[Key, MeasuredArrival]) -> dict[int, dict[int, str]]:
    """Ambiguous arrivals of rounds that count: the reason, by goal and by the round's number in tables, from 1."""
    first = not any(arrival.priming for arrival in log.arrivals)
    lost: dict[int, dict[int, str]] = {}
    for found in _counted(measured):
        if found.verdict is Verdict.AMBIGUOUS:
            lost.setdefault(found.arrival.goal, {})[found.arrival.round + first] = found.reason
    return lost


def _counted(measured: Mapping[Key, MeasuredArrival]) -> list[MeasuredArrival]:
    return [found for _, found in sorted(measured.items()) if not found.arrival.priming]


def write_run(
    directory: Path,
    log: ArrivalLog,
    events: Sequence[Event],
    unjudged: Mapping[int, str],
    truth_frame: str,
    scenario_name: str | None,
    seed: int,
    files: Mapping[str, bytes],
    replace: bool = False,
) -> Path:
    """Write the run directory. files: what is kept in its folder `measured`, by name.

    Raises:
        RecordError: there is a run already and `replace` is not set.
        DiskFullError: it cannot be written.
    """
    with RunWriter(directory, replace=replace) as writer:
        if log.record is not None:
            _copy_trajectories(log, writer)
        for event in events:
            writer.event(event)
        with writing(writer.folder):
            (writer.folder / "measured").mkdir()
            for name, content in files.items():
                (writer.folder / "measured" / name).write_bytes(content)
        return writer.finish(_manifest(log, events, unjudged, truth_frame, scenario_name, seed))


def _truths(log: ArrivalLog, measured: Mapping[Key, MeasuredArrival]) -> dict[Key, SE2]:
    """Poses in `map`, or in the waypoint's own frame, by round and goal."""
    truths: dict[Key, SE2] = {}
    for goal, target in enumerate(log.goals):
        poses = {key: found.pose for key, found in measured.items() if key[1] == goal and found.pose is not None}
        if not poses:
            continue
        counted = [pose for key, pose in poses.items() if not measured[key].arrival.priming]
        place = next(measured[key].station.place for key in poses)
        T_map_station = place if place is not None else target @ _mean(counted or list(poses.values())).inverse()
        truths |= {key: T_map_station @ pose for key, pose in poses.items()}
    return truths


def _mean(poses: Sequence[SE2]) -> SE2:
    rows = np.array([pose.array() for pose in poses])
    return SE2(float(rows[:, 0].mean()), float(rows[:, 1].mean()), mean_heading(rows[:, 2]))


def _not_seen(event: Arrival, reason: str) -> list[Event]:
    at = (event.t, event.round, event.goal)
    detail = f"navigation reported an arrival, but {reason}"
    return [
        GoalFailed(*at, event.target, Outcome.NOT_SEEN, detail, None, event.estimate, event.odometry),
        GoalSkipped(*at),
    ]


def _events_of_files(log: ArrivalLog, pause: float) -> list[Event]:
    """A journal from arrivals alone: a goal without one failed, and nobody says why."""
    rounds: dict[int, list[LoggedArrival]] = {}
    for arrival in log.arrivals:
        rounds.setdefault(arrival.round, []).append(arrival)
    events: list[Event] = []
    now = 0
    for number, arrivals in sorted(rounds.items()):
        started = max(now, arrivals[0].stamp - log.zero - round(pause * NANOSECONDS))
        events.append(RoundStarted(started, number, arrivals[0].priming))
        for arrival in arrivals:
            now = arrival.stamp - log.zero
            events.append(Arrival(now, number, arrival.goal, log.goals[arrival.goal], None, None, None))
        missed = [goal for goal in range(len(log.goals)) if goal not in {arrival.goal for arrival in arrivals}]
        for goal in missed:
            why = "the log of arrivals does not have it, nor why"
            events.append(GoalFailed(now, number, goal, log.goals[goal], Outcome.UNRECORDED, why, None, None, None))
            events.append(GoalSkipped(now, number, goal))
        events.append(RoundEnded(now, number, Outcome.UNRECORDED if missed else Outcome.REACHED, 0, 0))
    planned = log.rounds + any(arrival.priming for arrival in log.arrivals)
    return [*events, RunEnded(now, len(log.arrivals) == len(log.goals) * planned)]


def _copy_trajectories(log: ArrivalLog, writer: RunWriter) -> None:
    """Estimates, odometry, the floor plan and the method's log; never the truth, which a real robot has not."""
    assert log.record is not None
    source = log.record.directory
    with writing(writer.folder):
        for started in log.record.rounds():
            name = f"round{started.round:02d}"
            for kind in ("estimate.tum", "odometry.tum"):
                if (source / name / kind).exists():
                    (writer.folder / name).mkdir(exist_ok=True)
                    shutil.copyfile(source / name / kind, writer.folder / name / kind)
        for extra in ("plan.yaml", "plan.png", "method.log"):
            if (source / extra).exists():
                shutil.copyfile(source / extra, writer.folder / extra)


def _manifest(
    log: ArrivalLog,
    events: Sequence[Event],
    unjudged: Mapping[int, str],
    truth_frame: str,
    scenario_name: str | None,
    seed: int,
) -> Manifest:
    complete = all(event.complete for event in events if isinstance(event, RunEnded))
    changed: dict[str, object] = {
        "source": "measured",
        "truth_frame": truth_frame,
        "unjudged": {str(goal): reason for goal, reason in unjudged.items()},
        "complete": complete,
    }
    if log.record is not None:
        known = log.record.manifest.model_dump(mode="json")
        name = scenario_name or known["scenario_name"]
        versions = {**known["versions"], "taskslam measure": __version__}
        return Manifest.model_validate({**known, **changed, "versions": versions, "scenario_name": name})
    name = scenario_name or "measured"
    waypoints = [{"x": goal.x, "y": goal.y, "theta": goal.theta} for goal in log.goals]
    scenario = {"name": name, "sequence": {"waypoints": waypoints}, "protocol": {"on_failure": "skip"}}
    duration = (log.arrivals[-1].stamp - log.arrivals[0].stamp) / NANOSECONDS
    return Manifest.model_validate(
        {
            **changed,
            "scenario_name": name,
            "scenario": scenario,
            "scenario_hash": hashlib.sha256(json.dumps(scenario, sort_keys=True).encode()).hexdigest(),
            "driven_by": DrivenBy.ROBOT,
            "method": log.method,
            "method_card": {},
            "mode": log.mode,
            "seed": seed,
            "rounds": log.rounds,
            "latency": "as driven",
            "versions": {"taskslam measure": __version__},
            "started_utc": datetime.fromtimestamp(log.zero / NANOSECONDS, UTC).isoformat(),
            "wall_s": duration,
            "simulated_s": duration,
            "failure": None if complete else "not every arrival was logged and seen",
        }
    )
