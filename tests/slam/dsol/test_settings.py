import pytest

from taskslam.errors import InputError
from taskslam.slam.dsol.settings import DsolSettings


def test_the_default_is_what_the_benchmark_ran():
    s = DsolSettings.from_options({})
    assert (s.preset, s.cell, s.keyframes, s.levels, s.keyframe_ratio, s.min_depth) == ("paper", 20, 5, 4, 0.4, 0.1)
    assert (s.gyro, s.reinit, s.adjust) == (True, True, True)


def test_a_preset_gives_its_values_and_an_option_beats_it():
    assert DsolSettings.from_options({"preset": "indoor"}).keyframe_ratio == 0.8
    assert DsolSettings.from_options({"preset": "indoor", "keyframe_ratio": 0.6}).keyframe_ratio == 0.6


def test_the_preset_paper_is_the_default():
    assert DsolSettings.from_options({"preset": "paper"}) == DsolSettings.from_options({})


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"preset": "outdoor"}, "preset"),
        ({"keyframe_ratios": 0.5}, "Did you mean 'keyframe_ratio'"),
        ({"levels": 1}, "levels"),
        ({"c2": float("nan")}, "c2"),
    ],
)
def test_a_wrong_option_is_named(options, sentence):
    with pytest.raises(InputError, match=sentence):
        DsolSettings.from_options(options)
