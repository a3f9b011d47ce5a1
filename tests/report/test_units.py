import math

import pytest

from taskslam.evaluation.metrics_file import Interval
from taskslam.report.units import Units, both, task_number

UNITS = Units(0.3, 80.0)


def test_a_length_and_an_angle_are_said_in_both_units():
    assert UNITS.length(0.15, True) == '<span class="si">15.0 cm</span><span class="tu">0.500 D</span>'
    assert UNITS.angle(math.radians(10)) == '<span class="si">10.00</span><span class="tu">0.125</span>'


@pytest.mark.parametrize(("value", "text"), [(0.0123, "0.0123"), (0.5, "0.500"), (1.25, "1.25"), (12.0, "12.00")])
def test_task_numbers_show_the_decimals_that_matter(value, text):
    assert task_number(value) == text


def test_without_a_common_task_only_the_metric_number_is_there():
    units = Units(None, None)
    assert units.length(0.15, True) == "15.0 cm"
    assert units.length_unit == "cm"
    assert units.angle_unit == "°"


def test_what_is_not_defined_is_a_dash_in_either_unit():
    assert UNITS.length(None, True) == "–"
    assert UNITS.angle(None) == "–"
    assert UNITS.interval(None) == ""


def test_an_interval_has_both_ends():
    assert Units(None, None).interval(Interval(low=0.0033, high=0.006)) == "0.33–0.60"


def test_text_is_escaped():
    assert both("<b>", "&") == '<span class="si">&lt;b&gt;</span><span class="tu">&amp;</span>'
