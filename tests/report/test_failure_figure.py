import re

import pytest

from taskslam.geometry import SE2
from taskslam.report.failure_figure import failure_figure, number_list

GOALS = (SE2(0, 0, 0), SE2(10, 6, 0))


def labels(markup):
    return re.findall(r'font-weight="700" class="halo">([^<]+)<', markup)


@pytest.mark.parametrize(("numbers", "text"), [([3], "3"), ([2, 1, 3], "1–3"), ([7, 1, 2, 9], "1–2, 7, 9")])
def test_number_list(numbers, text):
    assert number_list(numbers) == text


def test_failures_at_one_place_share_a_cross_and_keep_their_numbers():
    markup = str(failure_figure(None, None, GOALS, [(1, SE2(2, 2, 0)), (2, SE2(8, 3, 0)), (3, SE2(2.01, 2, 0))]))
    assert labels(markup) == ["1, 3", "2"]
    assert len(re.findall(r'stroke="#D55E00"', markup)) == 2 * 2  # two strokes a cross


def test_a_crowd_of_failures_leaves_no_number_out():
    places = [(number, SE2(5 + 0.32 * (number % 6), 3 + 0.32 * (number // 6), 0)) for number in range(36)]
    markup = str(failure_figure(None, SE2(0, 0, 0), GOALS, places))
    shown = [int(number) for text in labels(markup) for number in re.findall(r"\d+", text)]
    assert len(shown) == 36
