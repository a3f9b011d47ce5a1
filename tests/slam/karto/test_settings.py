import pytest

from taskslam.errors import InputError
from taskslam.slam.karto.settings import KartoSettings


def test_published_values_are_the_defaults() -> None:
    """Protocol 1.3."""
    s = KartoSettings()
    assert (s.max_laser_range, s.minimum_travel_heading, s.minimum_time_interval) == (10.0, 0.1, 0.05)
    assert (s.scan_buffer_size, s.loop_search_maximum_distance, s.do_loop_closing) == (10, 3.0, True)
    assert (s.loop_match_minimum_response_coarse, s.loop_match_minimum_response_fine) == (0.35, 0.45)
    assert s.correlation_search_space_dimension == 0.5
    assert s.correlation_search_space_resolution == 0.01
    assert s.correlation_search_space_smear_deviation == 0.1
    assert s.loop_search_space_dimension == 2.0
    assert s.loop_search_space_resolution == 0.05
    assert s.loop_search_space_smear_deviation == 0.03


def test_an_unknown_option_is_named_with_its_neighbour() -> None:
    with pytest.raises(InputError, match=r"no option 'scan_bufer_size'.*Did you mean 'scan_buffer_size'"):
        KartoSettings.from_options({"scan_bufer_size": 5})


@pytest.mark.parametrize(
    "options",
    [
        {"scan_buffer_size": 0},
        {"max_laser_range": float("nan")},
        {"minimum_travel_distance": -1},
        {"deskew": "perhaps"},
    ],
)
def test_a_value_out_of_range_is_named(options) -> None:
    (name,) = options
    with pytest.raises(InputError, match=f"karto option {name}"):
        KartoSettings.from_options(options)
