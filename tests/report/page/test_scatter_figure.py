import math
import re

import pytest

from taskslam.report.markers import Style
from taskslam.report.page.scatter_figure import HEADING, Point, scatter_axis, scatter_figure

DOT = Style("#123456", 0)


def dots(markup):
    return [
        (float(x), float(y), fill)
        for x, y, fill in re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)" r="6" fill="([^"]+)"', markup)
    ]


def figure(*points):
    return str(scatter_figure(points, scatter_axis(points), 0.3, "test"))


def test_a_method_as_precise_as_accurate_stands_on_the_dashed_line():
    markup = figure(Point("a", 0.03, 0.03, True, DOT), Point("b", 0.3, 0.003, True, DOT))
    x1, y1, x2, y2 = (
        float(value)
        for value in re.search(
            r'<line x1="([\d.]+)" y1="([\d.]+)" x2="([\d.]+)" y2="([\d.]+)" stroke="var\(--vermilion\)"', markup
        ).groups()
    )
    on, below = dots(markup)[:2]
    assert on[1] == pytest.approx(y1 + (on[0] - x1) / (x2 - x1) * (y2 - y1), abs=0.02)
    assert below[1] > y1 + (below[0] - x1) / (x2 - x1) * (y2 - y1)


def test_a_marker_is_filled_only_if_every_waypoint_was_reached():
    fills = [fill for _, _, fill in dots(figure(Point("a", 0.03, 0.01, True, DOT), Point("b", 0.3, 0.1, False, DOT)))]
    assert fills == ["#123456", "var(--paper)"]


def test_a_second_axis_counts_robot_diameters():
    point = Point("a", 0.3, 0.03, True, DOT)
    assert "0.1 D" in figure(point)
    assert " D<" not in str(scatter_figure([point], scatter_axis([point]), None, "test"))


def test_no_method_at_all_leaves_empty_axes_that_say_so():
    assert dots(figure()) == []
    assert "no precision to show" in figure()


def test_headings_are_drawn_in_degrees_and_without_diameters():
    point = Point("a", math.radians(2.0), math.radians(0.5), True, DOT)
    markup = str(scatter_figure([point], scatter_axis([point], HEADING), None, "test", HEADING))
    assert "<title>a: Δ 0.50 °, δ 2.00 °</title>" in markup
    assert "Δ = δ" in markup
    assert ">5</text>" in markup  # the axis' end above two degrees
    assert " D<" not in markup
    assert "cm" not in markup
