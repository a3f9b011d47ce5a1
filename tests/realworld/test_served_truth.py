"""A tour on a robot that was our served simulator is given its true poses, by the robot's clock."""

import pytest

from taskslam.errors import InputError, RecordError
from taskslam.evaluation import evaluate_runs
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.realworld.served_truth import measure_served
from taskslam.record import Arrival, GoalFailed, RoundEnded, RoundStarted, RunEnded, RunWriter, load_run
from taskslam.record.served import Served, ServedRecord

ZERO = 1_000 * 10**9
GOALS = [SE2(1.0, 0.0, 0.0), SE2(2.0, 0.0, 0.0)]


@pytest.fixture
def tour(tmp_path):
    """Two rounds; at 2 s and 4 s of each the robot is at a goal, and in the second round fails the second one."""
    manifest = {
        "scenario_name": "room",
        "scenario": {"name": "room", "sequence": {"waypoints": [list(goal.array()) for goal in GOALS]}},
        "scenario_hash": "0", "method": "karto", "method_card": {}, "mode": "without-map", "seed": 0, "rounds": 2,
        "latency": "fixed", "started_utc": "1970-01-01T00:16:40+00:00", "wall_s": 1.0, "simulated_s": 1.0,
        "complete": False, "driven_by": "robot",
    }  # fmt: skip
    with RunWriter(tmp_path / "driven") as run:
        for number in range(2):
            start = number * 10 * 10**9
            run.event(RoundStarted(start, number, False))
            run.event(Arrival(start + 2 * 10**9, number, 0, GOALS[0], None, GOALS[0], None))
            if number == 0:
                run.event(Arrival(start + 4 * 10**9, number, 1, GOALS[1], None, GOALS[1], None))
                run.event(RoundEnded(start + 4 * 10**9, number, Outcome.REACHED, 1, 0))
        failed = (Outcome.NO_PLAN, "no way", None, GOALS[1], None)
        run.event(GoalFailed(14 * 10**9, 1, 1, GOALS[1], *failed))
        run.event(RoundEnded(14 * 10**9, 1, Outcome.NO_PLAN, 1, 0))
        run.event(RunEnded(14 * 10**9, False))
        return run.finish(manifest)


@pytest.fixture
def serve(tmp_path):
    """The record of a robot that goes 1 m every 2 s and begins anew at 10 s."""

    def make(seconds):
        served = Served(
            scenario={}, robot={}, seed=0, ros=1, variables={}, pace="", epoch=ZERO, publishes_truth=False, versions={},
            machine={}, started_utc="",
        )  # fmt: skip
        with ServedRecord(tmp_path / "served", served) as record:
            for step in range(round(seconds * 20)):
                at = step / 20
                record.truth(ZERO + step * 50_000_000, SE2((at % 10) / 2 + 0.01 * (at >= 10), 0.02, 0.0))
            record.end(0, seconds, 0, 0)
        return record.folder

    return make


def test_every_arrival_and_failure_has_the_true_pose_of_its_instant(tour, serve, tmp_path):
    record = load_run(measure_served(tour, serve(20), tmp_path / "measured"))
    arrivals = [event for event in record.events if isinstance(event, Arrival)]
    assert [arrival.truth.array() for arrival in arrivals] == [
        pytest.approx(pose) for pose in ([1.0, 0.02, 0.0], [2.0, 0.02, 0.0], [1.01, 0.02, 0.0])
    ]
    (failed,) = [event for event in record.events if isinstance(event, GoalFailed)]
    assert failed.truth.x == pytest.approx(2.01)
    assert failed.estimate == GOALS[1]
    assert (record.manifest.source, record.manifest.truth_frame) == ("measured", "map")
    evaluate_runs([tmp_path / "measured"])
    with pytest.raises(RecordError, match="exists already"):
        measure_served(tour, tmp_path / "served", tmp_path / "measured")


def test_a_record_of_another_time_or_none_is_refused(tour, serve, tmp_path):
    folder = serve(3)
    with pytest.raises(
        InputError, match=r"no true pose at 1004\.00 s by the robot's clock, the nearest is -1\.1 s off"
    ):
        measure_served(tour, folder, tmp_path / "measured")
    (folder / "served.json").write_text('{"format": "taskslam-served/1"}')
    with pytest.raises(RecordError, match=r"served\.json: not a record of a served robot"):
        measure_served(tour, folder, tmp_path / "measured")
