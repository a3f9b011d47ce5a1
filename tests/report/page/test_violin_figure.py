import re

import numpy as np
import pytest
from scipy.stats import gaussian_kde

from taskslam.report.kernel_density import kernel_density
from taskslam.report.log_axis import LogAxis, log_axis
from taskslam.report.page.violin_figure import violin_strip

AXIS = LogAxis(0.001, 1.0)


def test_the_density_is_scipys():
    values = np.random.default_rng(3).normal(2.0, 0.7, 40)
    at = np.linspace(-1, 5, 200)
    assert kernel_density(values, at) == pytest.approx(gaussian_kde(values)(at))


@pytest.mark.parametrize("values", [[], [1.0], [2.0, 2.0]])
def test_values_that_do_not_differ_have_no_density(values):
    with pytest.raises(ValueError, match="differ"):
        kernel_density(values, [0.0])


def outline(markup):
    points = re.search(r'<polygon points="([^"]+)"', markup).group(1)
    return np.array([[float(n) for n in pair.split(",")] for pair in points.split()])


def test_a_violin_ends_where_the_data_ends():
    values = [0.01, 0.02, 0.03, 0.1]
    x = outline(str(violin_strip(values, (), AXIS, "#123456", "karto")))[:, 0]
    assert [x.min(), x.max()] == pytest.approx([1000 / 3, 2000 / 3], abs=0.01)


def test_without_map_is_above_the_line_and_with_map_below():
    values = [0.01, 0.02, 0.03, 0.1]
    assert outline(str(violin_strip(values, (), AXIS, "#123456", "karto")))[:, 1].max() == pytest.approx(30)
    assert outline(str(violin_strip((), values, AXIS, "#123456", "karto")))[:, 1].min() == pytest.approx(30)


def test_the_solid_line_is_the_mean_and_the_dashed_ones_the_quartiles():
    values = [0.01, 0.02, 0.03, 0.04, 0.9]
    markup = str(violin_strip(values, (), AXIS, "#123456", "karto"))
    lines = re.findall(r'<line x1="([\d.]+)"[^>]*stroke="var\(--ink\)"([^>]*)>', markup)
    drawn = {
        re.search(r'stroke-dasharray="([^"]+)"', rest)[1] if "dash" in rest else "solid": float(x) for x, rest in lines
    }
    assert drawn["solid"] == pytest.approx(1000 * AXIS.share(0.2), abs=0.01)
    assert drawn["6 3"] == pytest.approx(1000 * AXIS.share(0.03), abs=0.01)


def test_two_values_are_two_lines_and_none_leaves_the_strip_empty():
    assert "<polygon" not in str(violin_strip([0.01, 0.02], (), AXIS, "#123456", "karto"))
    assert "#123456" not in str(violin_strip((), (), AXIS, "#123456", "karto"))


def test_an_error_of_nothing_is_drawn_at_the_floor():
    axis = log_axis([0.0, 0.01])
    assert "nan" not in str(violin_strip([0.0, 0.0, 0.01], (), axis, "#123456", "karto"))
    assert axis.share(0.0) == 0.0
