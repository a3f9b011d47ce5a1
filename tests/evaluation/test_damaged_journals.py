"""Whatever happens to a journal on the disk: never a crash, never more completeness than the intact one has."""

import functools
import shutil
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from taskslam.evaluation import evaluate_runs
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import Arrival, GoalFailed, GoalSkipped, GoalStarted, MethodNotice, RoundEnded, RoundStarted
from taskslam.record.run_directory import JOURNAL, MANIFEST

GOALS, ROUNDS = 4, 3
KINDS = ("abort", "skip", "with-map", "whole")


def journal(build, kind):
    """A run as the protocol writes it. Of `abort`, a round ends at goal 2; of `skip`, a goal fails in two rounds."""
    run = build(kind, goals=GOALS, rounds=ROUNDS, mode="with-map" if kind == "with-map" else "without-map")
    failing = {"abort": {(1, 2)}, "skip": {(0, 1), (2, 3)}, "with-map": {(3, 3)}, "whole": set()}[kind]
    rounds = ROUNDS + (kind == "with-map")
    for number in range(rounds):
        run.events.append(RoundStarted(run._tick(), number, priming=kind == "with-map" and number == 0))
        run.events.append(MethodNotice(run._tick(), number, "starting -> tracking"))
        outcome = Outcome.REACHED
        for goal, target in enumerate(run.goals):
            run.events.append(GoalStarted(run._tick(), number, goal, target))
            at = target @ SE2(0.01 * number, 0.02 * goal, 0.01)
            if (number, goal) not in failing:
                run.events.append(Arrival(run._tick(), number, goal, target, at, at, at))
                continue
            outcome = Outcome.NO_PLAN
            run.events.append(GoalFailed(run._tick(), number, goal, target, outcome, "why", at, at, at))
            if kind != "skip":
                run.events += [GoalSkipped(run._tick(), number, left) for left in range(goal + 1, GOALS)]
                break
        run.events.append(RoundEnded(run._tick(), number, outcome, 100, 2))
    scenario = {
        "sequence": {"waypoints": [{"x": g.x, "y": g.y, "theta": g.theta} for g in run.goals]},
        "protocol": {"on_failure": "skip" if kind == "skip" else "abort"},
    }
    return run.write(scenario=scenario)


@pytest.fixture
def intact(build):
    """The runs and what is true of them."""
    folders = {kind: journal(build, kind) for kind in KINDS}
    return {kind: (folder, evaluate_runs([folder]).runs[0]) for kind, folder in folders.items()}


def evaluated(folder: Path, data: bytes):
    """The metrics file of the run in `folder` with another journal."""
    with tempfile.TemporaryDirectory() as place:
        shutil.copy(folder / MANIFEST, place)
        (Path(place) / JOURNAL).write_bytes(data)
        return evaluate_runs([Path(place)])


def flip(data: bytes, at: int, value: int) -> bytes:
    return data[:at] + bytes([data[at] ^ (1 + value % 255)]) + data[at + 1 :]


def digit(data: bytes, at: int, value: int) -> bytes:
    """The harm that JSON does not notice."""
    places = [place for place, byte in enumerate(data) if 48 <= byte <= 57]
    place = places[at % len(places)]
    return data[:place] + bytes([48 + value % 10]) + data[place + 1 :]


def cut(data: bytes, at: int, value: int) -> bytes:
    return data[:at] + data[at + 8 * value :]


def wipe(data: bytes, at: int, value: int) -> bytes:
    return (data[:at] + bytes(8 * value) + data[at + 8 * value :])[: len(data)]


def line(data: bytes, at: int, value: int) -> bytes:
    """A line that is junk, empty, gone, or there twice."""
    lines = data.split(b"\n")
    place = at % (len(lines) - 1)
    lines[place : place + 1] = [[b"junk"], [b""], [], [lines[place]] * 2][value % 4]
    return b"\n".join(lines)


@settings(
    max_examples=400, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    kind=st.sampled_from(KINDS),
    harm=st.sampled_from([flip, digit, cut, wipe, line]),
    at=st.integers(0, 10**6),
    value=st.integers(0, 255),
)
@example(kind="abort", harm=line, at=0, value=0)
def test_damage_never_makes_a_run_more_complete(intact, kind, harm, at, value):
    folder, true = intact[kind]
    data = _read(folder / JOURNAL)
    found = evaluated(folder, harm(data, at % len(data), value))
    assert len(found.runs) + len(found.left_out) == 1
    for run in found.runs:
        assert run.completeness <= true.completeness + 1e-12
        assert run.complete_waypoints <= true.complete_waypoints
        assert all(not mine.complete or its.complete for mine, its in zip(run.waypoints, true.waypoints, strict=True))


@functools.cache
def _read(path: Path) -> bytes:
    return path.read_bytes()


def test_a_line_in_the_middle_costs_no_more_than_itself(intact):
    """The arrival at goal 2 in round 2, of a run that reached everything: judged on the other two rounds."""
    folder, true = intact["whole"]
    data = (folder / JOURNAL).read_bytes()
    wanted = [n for n, text in enumerate(data.split(b"\n")) if b'"arrival"' in text and b'"goal":1,' in text][1]
    (run,) = evaluated(folder, line(data, wanted, 0)).runs
    assert (true.completeness, run.completeness) == (1.0, 1.0)
    assert [(waypoint.visits, waypoint.rounds) for waypoint in run.waypoints] == [(3, 3), (2, 2), (3, 3), (3, 3)]
    assert [w == t for w, t in zip(run.waypoints, true.waypoints, strict=True)] == [True, False, True, True]
    (said,) = run.journal_damaged
    assert said.endswith(
        f"{JOURNAL}, line {wanted + 1}: expected one JSON object, but expected value at line 1 column 1"
    )


def test_a_waypoint_of_which_one_round_is_left_cannot_be_judged(intact):
    folder, _ = intact["whole"]
    data = (folder / JOURNAL).read_bytes()
    lines = [
        b"junk" if b'"arrival"' in text and b'"goal":1,' in text and b'"round":0' not in text else text
        for text in data.split(b"\n")
    ]
    (run,) = evaluated(folder, b"\n".join(lines)).runs
    assert run.waypoints[1].unjudged == "1 of 3 rounds known, 2 needed"
    assert (run.complete_waypoints, run.planned_waypoints) == (3, 3)
