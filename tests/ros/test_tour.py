"""A tour steered by a ROS node: the clock goes on over rounds, and what was driven before a failure is kept."""

import pytest

from taskslam.benchmark.run import run
from taskslam.errors import RecordError
from taskslam.mode import Mode
from taskslam.outcomes import Outcome
from taskslam.record.events import Arrival, GoalFailed, RoundEnded
from taskslam.record.run_directory import load_run

NEAR = [[-1.0, -1.0, 0.0], [-1.5, -1.0, 0.0]]


def drive(stage, out, file, mode):
    directory, complete = run(stage, stage.spec(f"ros:{file}", mode), out)
    return load_run(directory), complete


def changed(file, doing):
    """Do something while the file says something else, and put it back."""
    before = file.read_text()
    file.write_text(f"{before}summary: another\n")
    try:
        return doing()
    finally:
        file.write_text(before)


def of_kind(record, kind):
    return [event for event in record.events if isinstance(event, kind)]


def test_a_node_drives_a_tour_in_both_modes_and_the_same_twice(make_stage, write_node, rate_node, tmp_path):
    file = write_node(rate_node, latency=0.02)
    for mode, count, rounds in ((Mode.WITHOUT_MAP, 2, [0, 1]), (Mode.WITH_MAP, 1, [0, 1])):
        record, complete = drive(make_stage(NEAR, rounds=count), tmp_path / "one", file, mode)
        assert complete
        assert [event.outcome for event in of_kind(record, RoundEnded)] == [Outcome.REACHED] * len(rounds)
        assert [arrival.round for arrival in of_kind(record, Arrival)] == sorted(rounds * 2)
        assert record.manifest.method_card["loopback"]
    with pytest.raises(RecordError, match=r"a finished run of another content of ros:.*node0\.yaml stands there"):
        changed(file, lambda: drive(make_stage(NEAR, rounds=1), tmp_path / "one", file, Mode.WITH_MAP))
    again, _ = drive(make_stage(NEAR, rounds=1), tmp_path / "two", file, Mode.WITH_MAP)
    assert again.events == record.events


def test_earlier_rounds_are_kept_when_a_node_dies(make_stage, write_node, rate_node, tmp_path):
    whole, _ = drive(make_stage(NEAR, rounds=1), tmp_path / "whole", write_node(rate_node), Mode.WITH_MAP)
    scans = of_kind(whole, RoundEnded)[0].frames
    file = write_node(rate_node, parameters={"fault": "dies", "after": scans + 5})
    record, complete = drive(make_stage(NEAR, rounds=1), tmp_path / "cut", file, Mode.WITH_MAP)
    assert not complete
    assert [event.outcome for event in of_kind(record, RoundEnded)] == [Outcome.REACHED, Outcome.CRASHED]
    (failure,) = of_kind(record, GoalFailed)
    assert "the map has no cells" in failure.detail
    assert of_kind(record, Arrival) == of_kind(whole, Arrival)[:2]
