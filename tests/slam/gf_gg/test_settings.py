import pytest

from taskslam.errors import InputError
from taskslam.slam.gf_gg.settings import GfGgSettings


def test_the_default_is_what_the_benchmark_ran():
    s = GfGgSettings.from_options({})
    assert (s.preset, s.features, s.levels, s.scale, s.fast_threshold) == ("paper", 800, 8, 1.2, 20)
    assert (s.features_wanted, s.queries, s.graph_threshold, s.graph_cap) == (400, 20, 30, 60)
    assert (s.good_features, s.good_graph, s.odometry_prior) == (True, True, False)


def test_the_preset_paper_is_the_default():
    assert GfGgSettings.from_options({"preset": "paper"}) == GfGgSettings.from_options({})


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"preset": "indoor"}, "preset"),
        ({"good_feature": False}, "Did you mean 'good_features'"),
        ({"scale": 1.0}, "scale"),
        ({"close_depth": float("nan")}, "close_depth"),
    ],
)
def test_a_wrong_option_is_named(options, sentence):
    with pytest.raises(InputError, match=sentence):
        GfGgSettings.from_options(options)
