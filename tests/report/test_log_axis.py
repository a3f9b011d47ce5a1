import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.report.log_axis import LogAxis, log_axis


def test_the_ends_are_round_centimetres():
    assert log_axis([0.0044, 0.31]) == LogAxis(pytest.approx(0.002), pytest.approx(0.5))
    assert log_axis([0.02]) == LogAxis(pytest.approx(0.02), pytest.approx(0.2))


def test_ticks_are_round_in_their_own_unit():
    axis = LogAxis(0.002, 0.5)
    assert axis.ticks(0.01) == [0.2, 0.5, 1, 2, 5, 10, 20, 50]
    assert axis.ticks(0.01, most=5) == [1, 10]
    assert axis.ticks(0.3, most=5) == [0.01, 0.1, 1]


def test_equal_ratios_are_equal_distances():
    axis = LogAxis(0.001, 1.0)
    assert [axis.share(value) for value in (0.001, 0.01, 0.1, 1.0)] == pytest.approx([0, 1 / 3, 2 / 3, 1])
    assert axis.share(7.0) == 1.0


@given(st.lists(st.floats(0, 100), max_size=10))
def test_every_length_lies_on_the_axis(lengths):
    axis = log_axis(lengths)
    assert axis.high >= 10 * axis.low * (1 - 1e-9)
    for length in lengths:
        assert max(length, 1e-4) >= axis.low * (1 - 1e-9)
        assert length <= axis.high
