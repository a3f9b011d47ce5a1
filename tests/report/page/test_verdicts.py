import re

import pytest

from taskslam.report import write_report


@pytest.fixture
def verdicts(tmp_path):
    """The sentences at the head of the page about the results folder, without their tags, metric."""

    def tell():
        text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
        head = text[text.index('<div class="findings') : text.index('<form class="controls"')]
        head = re.sub(r'<span class="tu">.*?</span>', "", head)
        return [re.sub(r"<[^>]+>", "", item) for item in re.findall(r"<li>(.*?)</li>", head)]

    return tell


def test_who_arrived_everywhere_who_did_not_and_why(make_run, verdicts):
    make_run("a", method="karto")
    make_run("b", method="hector", failed=True)
    make_run("c", method="truth", card={"kind": "reference"})
    said = verdicts()
    assert said[0] == "1 of 2 methods reached every waypoint in every round: karto."
    assert "hector reached 2 of 3 waypoints every time: no path to the goal (1×)." in said
    assert said[-1].startswith("truth is told the truth and shows what navigation alone can do:")


def test_more_repeatable_is_said_only_where_the_data_carry_it(make_run, verdicts):
    make_run("a", method="close", rounds=8, spread=0.001)
    make_run("b", method="far", rounds=8, spread=0.1)
    make_run("c", method="further", rounds=8, spread=0.11)
    said = verdicts()
    assert "close is more repeatable than far and further." in said
    assert not [sentence for sentence in said if sentence.startswith("far is more repeatable")]
    assert "The data tell 2 of 3 pairs apart (95 %, corrected); all of them." in said


def test_if_nobody_arrived_everywhere_the_one_who_came_furthest_is_named(make_run, verdicts):
    for name in "abc":
        make_run(name, method=name, failed=True)
    assert verdicts()[0] == "No method reached every waypoint in every round; a came furthest with 67 %."


def test_if_nobody_arrived_anywhere_nobody_is_praised(make_run, verdicts):
    for name in "abc":
        make_run(name, method=name, failed=True, failed_goal=0)
    assert verdicts()[0] == "No method reached any waypoint in every round."


def test_a_method_that_lacks_a_mode_is_named(make_run, verdicts):
    make_run("a", method="a")
    make_run("b", method="b", mode="with-map")
    make_run("c", method="c", mode="with-map")
    said = verdicts()
    assert "b and c have no run in this mode." in said
    assert "a has no run in this mode." in said


def test_a_run_that_ended_in_its_priming_round_is_said(make_run, verdicts):
    make_run("a", method="a", mode="with-map")
    make_run("b", method="b", mode="with-map")
    make_run("c", method="c", mode="with-map", failed=True, driven=0)
    assert "c reached 0 of 3 waypoints every time: no path to the goal (1×); 1 run ended in the priming round." in (
        verdicts()
    )


@pytest.mark.parametrize(
    ("driven", "said"),
    [
        (0, "The run ended in its priming round, so that no round was driven."),
        (2, "No waypoint was reached in all 3 rounds: only 2 of them were driven, so there is no precision to state."),
    ],
)
def test_a_run_says_how_far_it_got(make_run, tmp_path, driven, said):
    make_run(mode="with-map", failed=True, driven=driven)
    assert said in write_report([tmp_path / "results"], tmp_path / "r.html").read_text()


def test_names_are_escaped(make_run, tmp_path):
    for name in "ab":
        make_run(name, method=f"<i>{name}")
    make_run("c", method="c", failed=True)
    text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    assert "<b>&lt;i&gt;a</b>" in text
    assert "<i>a" not in text
