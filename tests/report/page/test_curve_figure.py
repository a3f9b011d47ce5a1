import re

import numpy as np
import pytest

from taskslam.evaluation.curves import cumulative_precision
from taskslam.report.markers import Style
from taskslam.report.page.curve_figure import Curve, _tick, curve_figure, enlarged_limit
from taskslam.report.step_curve import step_corners

BLACK = Style("#000", 0)


def test_the_drawn_steps_are_the_cumulative_curve():
    curve = Curve((0.01, 0.03, 0.03, 0.5), planned=5, style=BLACK, dashed=False)
    steps = step_corners(curve.precisions, curve.planned, 0.0, 1.2)
    assert (np.diff(steps[:, 0]) >= 0).all()
    for x, share in zip(*[axis.tolist() for axis in steps.T], strict=True):
        below = cumulative_precision(curve.precisions, 5, [x, np.nextafter(x, 2)])
        assert below[0] - 1e-12 <= share <= below[1] + 1e-12


def test_values_beyond_the_axis_are_left_off():
    steps = step_corners((0.01, 5.0), planned=2, low=0.0, high=0.15)
    assert steps[-1].tolist() == [0.15, 0.5]


def test_both_axes_are_labelled():
    text = str(curve_figure([Curve((0.01,), 1, BLACK, True)], 1.2, 0.3))
    assert [label for label in ("0 D", "4 D", ">120<", "100 %") if label not in text] == []
    assert re.search(r"stroke-dasharray", text)


def test_ticks_divide_the_axis_evenly():
    for limit in (0.015, 0.03, 0.06, 0.15, 0.3, 1.2, 1.424):
        parts = limit / _tick(limit)
        assert 3 < parts < 8.001
        assert abs(parts - round(parts)) < 1e-6


def test_the_enlarged_axis_holds_every_curve_if_one_can():
    assert enlarged_limit([Curve((0.01, 0.032), 2, BLACK, False)], 0.3) == pytest.approx(0.06)
    assert enlarged_limit([Curve((0.01, 0.9), 2, BLACK, False)], 0.3) == pytest.approx(0.15)
    assert enlarged_limit([], 0.3) == pytest.approx(0.015)
