import re

from taskslam.geometry import SE2
from taskslam.report.page.failure_marks import FailurePlace
from taskslam.report.page.waypoints_figure import waypoints_figure

GOALS = (SE2(0, 0, 0), SE2(10, 6, 0))


def test_each_goal_is_a_link_that_a_screen_reader_finds():
    markup = str(waypoints_figure(None, None, GOALS, [True, False], [], "house"))
    assert re.findall(r'aria-label="(Waypoint \d)"', markup) == ["Waypoint 1", "Waypoint 2"]
    assert re.findall(r'data-goal="(\d)"', markup) == ["0", "1"]
    assert 'role="group"' in markup  # in an `img` nothing could be reached


def test_a_goal_that_any_run_missed_is_hollow():
    markup = str(waypoints_figure(None, SE2(1, 1, 0), GOALS, [True, False], [], "house"))
    assert re.findall(r'r="11" fill="([^"]+)"', markup) == ["var(--ink)", "var(--paper)"]


def test_a_failure_far_from_every_goal_is_still_in_the_picture():
    far = FailurePlace(1, SE2(-20.0, -9.0, 0.0), "m1", "with-map")
    markup = str(waypoints_figure(None, None, GOALS, [True, True], [far], "house"))
    width, height = map(float, re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', markup).groups())
    x, y = map(float, re.search(r'<line x1="([-\d.]+)" y1="([-\d.]+)"[^>]*stroke-width="7"', markup).groups())
    assert 0 < x < width
    assert 0 < y < height
