import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.datasets.distortion import DISTORTION_MODELS, lens
from taskslam.errors import DatasetError


@pytest.mark.parametrize(
    ("name", "given_", "expected"),
    [
        ("plumb_bob", [0.1, 0.2, 0.01, 0.02, 0.3], ("radial-tangential", (0.1, 0.2, 0.01, 0.02, 0.3))),
        ("radtan", [0.1, 0.2, 0.01, 0.02], ("radial-tangential", (0.1, 0.2, 0.01, 0.02))),
        ("plumb_bob", [0.1, 0, 0, 0, 0, 0, 0, 0], ("radial-tangential", (0.1, 0, 0, 0))),
        ("rational_polynomial", [0.1, 0.2, 0, 0, 0.3], ("radial-tangential", (0.1, 0.2, 0, 0, 0.3))),
        ("rational_polynomial", [0.1] * 8 + [0] * 6, ("radial-tangential", (0.1,) * 8)),
        ("plumb_bob", [], ("none", ())),
        ("", [], ("none", ())),
        ("none", [0, 0, 0, 0], ("none", ())),
        ("radtan", [0, 0, 0, 0], ("none", ())),
        ("equidistant", [], ("none", ())),
        ("fisheye", [0, 0, 0, 0], ("equidistant", (0, 0, 0, 0))),
        ("equi", [0.1, 0, 0, 0], ("equidistant", (0.1, 0, 0, 0))),
        ("Radial-Tangential", [0.1, 0, 0, 0], ("radial-tangential", (0.1, 0, 0, 0))),
        ("kannala brandt", [0.1, 0.2, 0, 0], ("equidistant", (0.1, 0.2, 0, 0))),
    ],
)
def test_a_lens_by_any_name(name, given_, expected):
    assert lens(name, given_, "here") == expected


@pytest.mark.parametrize(
    ("name", "given_", "message"),
    [
        ("omni", [0.1], "here: distortion model 'omni'; expected one of brown, equi"),
        ("thin_prism_fisheye", [0.1] * 12, "distortion model 'thin_prism_fisheye'"),
        ("rational_polynomial", [0.1] * 12, "12 coefficients: thin prisms or a tilted sensor"),
        ("equidistant", [0.1] * 5, "5 coefficients for the distortion model 'equidistant'; expected 0 or 4"),
        ("radtan", [0.1] * 3, "3 coefficients .* expected 0 or 4 or 5 or 8 or 12 or 14"),
        ("none", [0.1], "'none' with 1 coefficients that are not zero"),
    ],
)
def test_what_is_not_read_is_named(name, given_, message):
    with pytest.raises(DatasetError, match=message):
        lens(name, given_, "here")


@given(st.lists(st.floats(-1, 1), max_size=8), st.sampled_from([8, 12, 14]))
def test_zeros_behind_the_last_coefficient_change_nothing(values, length):
    model, coefficients = lens("plumb_bob", [*values, *[0.0] * (length - len(values))], "here")
    assert len(coefficients) in DISTORTION_MODELS[model]
    assert lens("radtan", coefficients, "here") == (model, coefficients)
    assert [*coefficients, *[0.0] * 8][: len(values)] == values
