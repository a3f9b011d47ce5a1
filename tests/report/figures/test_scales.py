import pytest

from taskslam.report.figures.scales import orientation, position, scale_of

D, FOV = position(0.30), orientation(80.0)


def test_values_within_a_factor_of_eight_share_a_linear_axis_from_zero():
    scale = scale_of([2.0, 9.0])
    assert (scale.log, scale.low) == (False, 0.0)
    assert scale.high >= 9.0


def test_values_over_decades_share_a_logarithmic_axis_that_holds_them():
    scale = scale_of([0.2, 45.0])
    assert scale.log
    assert scale.low <= 0.2
    assert scale.high >= 45.0


def test_task_ticks_are_the_published_ones_where_whole_diameters_fit():
    ticks = scale_of([40.0, 110.0]).ticks(D, "task")
    assert ticks[:4] == [(0.0, "0"), (30.0, "1"), (60.0, "2"), (90.0, "3")]


def test_task_ticks_are_sixths_of_a_diameter_and_sixteenths_of_a_view_where_errors_are_small():
    assert (5.0, "1/6") in [(round(place, 9), text) for place, text in scale_of([10.0, 22.0]).ticks(D, "task")]
    assert (5.0, "1/16") in scale_of([10.0, 22.0]).ticks(FOV, "task")


@pytest.mark.parametrize("values", [[0.01, 1.0], [0.3, 60.0], [0.02, 3.0], [5.0], [0.7, 5.0], []])
@pytest.mark.parametrize("units", ["metric", "task"])
@pytest.mark.parametrize("quantity", [D, FOV])
def test_every_axis_has_two_to_seven_ticks_that_say_where_they_stand(values, units, quantity):
    scale = scale_of(values)
    ticks = scale.ticks(quantity, units)
    assert 2 <= len(ticks) <= 8
    for place, text in ticks:
        count, _, parts = text.partition("/")
        size = quantity.size if units == "task" else 1.0
        assert place == pytest.approx(float(count) / float(parts or 1) * size)
        assert scale.low <= place * (1 + 1e-9)
        assert place <= scale.high * (1 + 1e-9)


def test_a_task_unit_of_no_one_size_has_no_ticks():
    assert scale_of([1.0]).ticks(position(None), "task") == []


def test_zero_is_held_at_the_low_end_of_a_logarithmic_axis():
    scale = scale_of([0.0, 5.0])
    assert scale.log
    assert scale.held(0.0) == scale.low > 0


def test_a_linear_axis_is_kept_over_decades_where_it_is_asked_for():
    scale = scale_of([0.2, 45.0], linear=True)
    assert (scale.log, scale.low) == (False, 0.0)
    assert scale.high >= 45.0
