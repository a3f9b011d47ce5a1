import re

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import GoalFailed, GoalStarted, MethodNotice, RoundStarted, Trajectory
from taskslam.report import words, write_report
from taskslam.report.page.failure_story import failure_story

SECOND = 1_000_000_000
TARGET = SE2(10.0, 0.0, 0.0)


class FakeTracks:
    """Trajectories from memory."""

    def __init__(self, truth, estimate):
        self.kept = {"truth": truth, "estimate": estimate}

    def get(self, round_number, name):
        return self.kept[name]


def track(stamps_s, xs):
    xs = np.asarray(xs, dtype=float)
    return Trajectory((np.asarray(stamps_s) * SECOND).astype(np.int64), np.column_stack([xs, 0 * xs, 0 * xs]))


NOBODY = track([], [])


def story(notices=(), truth=NOBODY, estimate=NOBODY, detail="No path to the goal.", end=60):
    failure = GoalFailed(end * SECOND, 1, 2, TARGET, Outcome.NO_PLAN, detail, None, None, None)
    events = [RoundStarted(0, 1, priming=False), GoalStarted(20 * SECOND, 1, 2, TARGET)]
    events += [MethodNotice(int(t * SECOND), 1, text) for t, text in notices]
    return failure_story(failure, [*events, failure], FakeTracks(truth, estimate), tolerance_m=0.2)


def lines(told):
    return [(round(step.before_s, 1), step.text) for step in told.steps]


def test_it_begins_with_the_goal_and_ends_with_the_failure():
    assert lines(story()) == [
        (60.0, "the round begins"),
        (40.0, "sets out from waypoint 2 for waypoint 3"),
        (0.0, "No path to the goal."),
    ]


def test_a_failure_without_a_word_is_named_by_its_outcome():
    assert lines(story(detail=""))[-1] == (0.0, "no path to the goal")


def test_notices_that_differ_in_numbers_alone_become_one_line():
    told = story([(50.0, "jumped by 0.54 m"), (50.5, "jumped by 0.61 m"), (51.0, "tracking -> lost")])
    assert lines(told)[2:-1] == [
        (10.0, "2 times until 9.5 s before the end, first: jumped by 0.54 m"),
        (9.0, "tracking → lost"),
    ]


def test_notices_of_earlier_goals_are_left_out_unless_the_method_was_not_tracking_when_it_set_out():
    assert "jumped" not in str(lines(story([(10.0, "jumped by 1 m")])))
    assert (50.0, "tracking -> lost") in lines(story([(10.0, "tracking -> lost")]))
    assert "lost" not in str(lines(story([(5.0, "tracking -> lost"), (10.0, "lost -> tracking")])))


def test_it_says_since_when_the_estimate_was_off_and_since_when_the_robot_stood():
    seconds = np.arange(0, 60.01, 0.5)
    truth = track(seconds, np.minimum(seconds, 50) * 0.2)
    off = np.where(seconds < 45, 0.1, 0.3)
    told = story(truth=truth, estimate=track(seconds, truth.poses[:, 0] + off))
    assert (15.0, "the estimate is 30.0 cm off the truth, and stays off by more than navigation's tolerance of 20.0 cm") in lines(told)  # fmt: skip  # noqa: E501
    stood = next(step for step in told.steps if "stand" in step.text)
    assert stood.before_s == pytest.approx(10.0, abs=0.5)


def test_an_estimate_that_came_back_within_the_tolerance_is_no_cause():
    seconds = np.arange(0, 60.01, 0.5)
    truth = track(seconds, seconds * 0.1)
    off = np.where((seconds > 30) & (seconds < 40), 0.5, 0.05)
    assert "off the truth" not in str(lines(story(truth=truth, estimate=track(seconds, truth.poses[:, 0] + off))))


def test_a_method_that_fell_silent_is_told():
    seconds = np.arange(0, 60.01, 0.5)
    truth = track(seconds, seconds * 0.1)
    told = story(truth=truth, estimate=track(seconds[seconds <= 52], truth.poses[seconds <= 52, 0]))
    assert (8.0, "the last estimate; SLAM is silent from here") in lines(told)
    assert np.isnan(told.error[told.times > -7.9]).all()


def test_speed_and_error_are_those_of_the_motion():
    seconds = np.arange(0, 60.01, 0.05)
    truth = track(seconds, seconds * 0.3)
    told = story(truth=truth, estimate=track(seconds, truth.poses[:, 0] + 0.07))
    assert told.times[0] == -30.0
    assert told.speed == pytest.approx(0.3)
    assert told.error == pytest.approx(0.07)


def test_a_long_story_is_shortened_in_its_middle_and_a_long_text_cut():
    told = story([(30 + number, "abcdefghijklmnopqrstuvwxyz"[number] * 5) for number in range(26)], detail="x" * 5000)
    assert len(told.steps) == 13  # twelve and the failure
    assert "and 17 more notices" in str(lines(told))
    assert len(told.steps[-1].text) == 200


KINDS = [outcome for outcome in Outcome if outcome.blames in ("navigation", "method")]


@pytest.mark.parametrize("outcome", KINDS, ids=str)
def test_every_kind_of_failure_says_where_and_why_on_the_page(make_run, tmp_path, outcome):
    make_run("odd", failed=True, outcome=outcome, slam_off=0.43)
    page = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    (story,) = re.findall(r'<details class="story".*?</details>', page, re.DOTALL)
    said = " ".join(re.sub(r"<[^>]+>", " ", story).split())
    assert (
        f"round 3, waypoint 3: {words.outcome(outcome.value)} · SLAM 43.0 cm 1.43 D off" in said
    )  # one unit is hidden
    assert "truly at (5.97, 4.00) m, as SLAM has it at (6.40, 4.00) m" in said
    assert "SLAM puts the robot 43.0 cm and 0.00° from where it truly is" in said
    assert "&lt;b&gt;no plan&lt;/b&gt; &amp; so" in said
    assert ("what it printed: odd/method.log" in said) == (outcome.blames == "method")
    assert ("reported by navigation" in said) == (outcome.blames == "navigation")


def test_without_a_true_pose_the_page_does_not_say_how_far_slam_was_off():
    assert not [step for step in story().steps if step.text.startswith("SLAM puts")]
