import pytest

from taskslam.outcomes import Outcome
from taskslam.report import words


@pytest.mark.parametrize(
    ("metres", "text"), [(None, "–"), (0.0175, "1.75"), (0.1234, "12.3"), (0.0995, "9.95"), (1.234, "123")]
)
def test_centimetres_show_the_decimals_that_matter(metres, text):
    assert words.centimetres(metres) == text


def test_outcomes_are_counted_the_most_frequent_first():
    assert words.outcomes({"bumped": 1, "no_plan": 3, "crashed": 1}) == (
        "no path to the goal (3×), bumped into something (1×), the method crashed (1×)"
    )
    assert words.outcomes({}) == ""


def test_every_outcome_that_can_reach_the_page_has_words():
    for outcome in Outcome:
        if outcome.blames != "infrastructure":
            assert words.outcome(outcome.value) != outcome.value.replace("_", " ") or outcome is Outcome.REACHED
