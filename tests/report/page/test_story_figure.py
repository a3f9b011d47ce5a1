import re

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record import GoalFailed
from taskslam.report.page.failure_story import Story
from taskslam.report.page.last_seconds_figure import last_seconds_figure
from taskslam.report.page.story_figure import story_figure

PATH = np.column_stack([np.linspace(0, 3, 50), np.zeros(50), np.zeros(50)])


def told(times=(), speed=(), error=()):
    return Story(
        (), *(np.array(values, dtype=float) for values in (times, speed, error)), PATH, PATH + np.array([0, 0.1, 0])
    )


TRUTH, ESTIMATE, TARGET = SE2(3, 0, 0), SE2(3, 0.1, 0), SE2(4, 0, 0)


def middle(markup, ending):
    """Where the first circle with these attributes stands."""
    return tuple(map(float, re.search(rf'<circle cx="([\d.]+)" cy="([\d.]+)" {ending}', markup).groups()))


def figure(truth=TRUTH, estimate=ESTIMATE, target=TARGET):
    failure = GoalFailed(1, 0, 6, target, Outcome.NO_PLAN, "", truth, estimate, None)
    return story_figure(None, failure, told(), 0.3)


def test_robot_belief_and_goal_are_drawn_where_they_were():
    markup = str(figure())
    cross_x, cross_y = middle(markup, r'r="[\d.]+" fill="var\(--blue\)"')
    belief_x, belief_y = middle(markup, r'r="[\d.]+" fill="var\(--orange\)"')
    goal_x, _ = middle(markup, 'r="11"')
    metre = goal_x - cross_x
    assert belief_x == pytest.approx(cross_x, abs=0.02)
    assert cross_y - belief_y == pytest.approx(0.1 * metre, abs=0.05)


def test_what_is_far_away_is_told_with_an_arrow():
    markup = str(figure(estimate=SE2(-22.8, 0, 0), target=SE2(3, 40, 0)))
    assert "SLAM puts the robot 25.8 m that way" in markup
    assert "the goal lies 40.0 m that way" in markup
    assert 'fill="var(--orange)"' not in markup


def test_without_the_truth_the_estimate_is_where_it_failed_and_without_both_there_is_no_map():
    assert "✕" not in str(figure(truth=None))
    assert figure(truth=None) is not None
    assert figure(truth=None, estimate=None) is None


def test_the_last_seconds_show_what_is_known():
    times = np.arange(-10, 0.1, 0.25)
    both = str(last_seconds_figure(told(times, 0.3 + 0 * times, 0.5 + 0 * times), 0.2))
    assert "true speed" in both
    assert "distance from truth" in both
    speed = str(last_seconds_figure(told(times, 0.3 + 0 * times, np.nan * times), 0.2))
    assert "distance from truth" not in speed
    assert "nan" not in speed
    assert last_seconds_figure(told(times, np.nan * times, np.nan * times), 0.2) is None
