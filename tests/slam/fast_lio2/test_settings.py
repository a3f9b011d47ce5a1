import pytest

from taskslam.errors import InputError
from taskslam.slam.fast_lio2.settings import FastLio2Settings
from taskslam.slam.option_settings import read_options


def test_the_defaults_are_the_published_settings() -> None:
    s = FastLio2Settings()
    assert (s.point_filter_num, s.blind, s.filter_size_surf, s.filter_size_map, s.max_iteration) == (
        4,
        2.0,
        0.5,
        0.5,
        3,
    )
    assert (s.acc_cov, s.gyr_cov, s.b_acc_cov, s.b_gyr_cov) == (0.1, 0.1, 1e-4, 1e-4)
    assert (s.neighbours, s.neighbour_distance, s.plane_tolerance, s.match_score) == (5, 5**0.5, 0.1, 0.9)
    assert (s.point_cov, s.extrinsic_est_en, s.map_point, s.deskew) == (1e-3, False, "nearest", True)


def test_a_preset_lies_under_what_is_given() -> None:
    s = FastLio2Settings(preset="indoor", filter_size_map=0.3)
    assert (s.filter_size_surf, s.filter_size_map, s.map_point, s.acc_cov) == (0.2, 0.3, "first", 0.1)


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("preset", "outdoor"),
        ("point_filter_num", 0),
        ("filter_size_map", 0.0),
        ("acc_cov", -1.0),
        ("deskew", "perhaps"),
    ],
)
def test_what_cannot_be_is_refused_by_name(option, value) -> None:
    with pytest.raises(InputError, match=f"fast_lio2 option .*{option}"):
        read_options(FastLio2Settings, "fast_lio2", {option: value})


def test_a_misspelt_option_gets_a_guess() -> None:
    with pytest.raises(InputError, match="Did you mean 'filter_size_map'"):
        read_options(FastLio2Settings, "fast_lio2", {"filter_sizemap": 1.0})
