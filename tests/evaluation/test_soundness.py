"""A journal that cannot belong to its run.json, or says nothing about the method, is refused in one sentence."""

import pytest

from taskslam.errors import RecordError
from taskslam.evaluation.soundness import check_record
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import load_run


def test_more_rounds_than_planned_are_refused(build):
    run = build(goals=1, rounds=1).round(0, {0: SE2()}).round(1, {0: SE2()})
    with pytest.raises(RecordError, match=r"the journal has 2 rounds, run\.json says 1"):
        check_record(load_run(run.write()))


def test_a_goal_past_the_sequence_is_refused(build):
    run = build(goals=2, rounds=1).round(0, {1: SE2()})
    run.goals = run.goals[:1]
    with pytest.raises(RecordError, match="goal 1 in the journal; the sequence has 1"):
        check_record(load_run(run.write()))


def test_two_arrivals_at_one_goal_in_a_round_are_refused(build):
    run = build(goals=1, rounds=1).round(0, {0: SE2()})
    run.events.insert(2, run.events[2])
    with pytest.raises(RecordError, match="two arrivals at goal 0 in round 0"):
        check_record(load_run(run.write()))


def test_a_run_ended_by_the_infrastructure_is_not_counted_against_the_method(build):
    run = build(goals=1, rounds=1).round(0, {}, failed=(0, Outcome.DISK_FULL))
    with pytest.raises(RecordError, match="ended by disk_full, which says nothing about the method"):
        check_record(load_run(run.write()))


def test_a_pose_that_is_no_place_is_refused(build):
    run = build(goals=1, rounds=3).round(0, {0: SE2(1e40, 0, 0)}).round(1, {0: SE2()}).round(2, {0: SE2()})
    with pytest.raises(RecordError, match=r"goal 0 in round 0: a pose at \(1e\+40, 0\) m; expected one within 1e\+07"):
        check_record(load_run(run.write()))
