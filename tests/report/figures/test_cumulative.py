import numpy as np

from taskslam.report.figures.cumulative import Curve, steps
from taskslam.report.figures.scales import Scale
from taskslam.report.markers import Style

STYLE = Style("#000000", 0)


def test_the_curve_rises_at_each_waypoint_and_ends_at_the_completeness():
    points = steps(Curve(STYLE, False, (4.0, 1.0), planned=4), Scale(0.0, 10.0, log=False))
    assert points.tolist() == [[0, 0], [1, 0], [1, 25], [4, 25], [4, 50], [10, 50]]


def test_values_beyond_the_axis_do_not_raise_the_curve():
    points = steps(Curve(STYLE, False, (4.0, 20.0), planned=2), Scale(0.0, 10.0, log=False))
    assert points[-1].tolist() == [10, 50]


def test_no_complete_waypoint_is_a_line_at_zero():
    points = steps(Curve(STYLE, False, (), planned=3), Scale(0.1, 30.0, log=True))
    assert np.all(points[:, 1] == 0)
