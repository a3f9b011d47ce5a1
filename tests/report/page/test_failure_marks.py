import re

import pytest

from taskslam.geometry import SE2
from taskslam.report.page.failure_marks import FailurePlace, draw_failures, number_list
from taskslam.report.page.plan_drawing import PlanView
from taskslam.report.svg import Svg


def drawing(*places):
    """places: number, x, y, and perhaps method and mode."""
    svg = Svg(1000, 600, "test")
    view = PlanView(left=0.0, top=6.0, scale=100.0, width=1000.0, height=600.0)
    filled = [(*place, *("m1", "with-map")[len(place) - 3 :]) for place in places]
    draw_failures(svg, [FailurePlace(n, SE2(x, y, 0.0), method, mode) for n, x, y, method, mode in filled], view)
    return str(svg.markup())


def labels(markup):
    return re.findall(r'font-weight="700" class="halo">([^<]+)<', markup)


@pytest.mark.parametrize(("numbers", "text"), [([3], "3"), ([2, 1, 3], "1–3"), ([7, 1, 2, 9], "1–2, 7, 9")])
def test_number_list(numbers, text):
    assert number_list(numbers) == text


def test_failures_at_one_place_share_a_cross_and_keep_their_numbers():
    markup = drawing((1, 2, 2), (2, 8, 3), (3, 2.01, 2))
    assert labels(markup) == ["1, 3", "2"]
    assert len(re.findall(r'stroke="var\(--vermilion\)"', markup)) == 2 * 2  # two strokes a cross


def test_a_crowd_of_failures_leaves_no_number_out():
    markup = drawing(*((number, 5 + 0.32 * (number % 6), 3 + 0.32 * (number // 6)) for number in range(36)))
    shown = [int(number) for text in labels(markup) for number in re.findall(r"\d+", text)]
    assert len(shown) == 36


def test_the_filter_may_hide_a_cross_only_if_it_belongs_to_one_method():
    markup = drawing((1, 2, 2, "m1", "with-map"), (2, 2.01, 2, "m2", "with-map"), (3, 8, 3, "m2", "without-map"))
    groups = re.findall(r"<g pointer-events=\"none\"([^>]*)>", markup)
    assert groups == [' data-mode="with-map"', ' data-method="m2" data-mode="without-map"']
