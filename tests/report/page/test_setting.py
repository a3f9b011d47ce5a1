import pytest

from taskslam.report.page.setting import facts
from taskslam.report.results import read_results


@pytest.fixture
def told(tmp_path):
    """The facts of all runs below the results folder, by name."""

    def tell():
        return {fact.name: fact.values for fact in facts(read_results([tmp_path / "results"]).runs)}

    return tell


def test_what_all_runs_share_is_said_once(make_run, told):
    make_run("a", method="a")
    make_run("b", method="b")
    found = told()
    assert found["Seed"] == (("0", ""),)
    assert found["Robot"] == (("turtlebot2", ""),)
    assert found["Task units"] == (("D = 30 cm (robot diameter), FoV = 80° (field of view)", ""),)
    assert found["Software"] == (("taskslam 0", ""),)


def test_where_runs_differ_each_value_says_whose_it_is(make_run, told):
    make_run("a", method="a")
    make_run("b", method="b", versions={"taskslam": "1"})
    assert told()["Software"] == (("taskslam 0", "a, without map"), ("taskslam 1", "b, without map"))


def test_many_runs_of_one_value_are_counted(make_run, told):
    for name in "abcd":
        make_run(name, method=name, latency="zero")
    make_run("e", method="e", latency="measured")
    assert told()["Latency"] == (("zero: every estimate arrives at once", "4 runs"), ("measured", "e, without map"))


def test_a_card_without_a_latency_is_said(make_run, told):
    make_run("a", method="a", card={"latency": 0.02})
    make_run("b", method="b", card={"latency": None})
    assert told()["Latency"] == (
        ("fixed: the value on each method's card", "a, without map"),
        ("fixed, but the method's card names none: every estimate arrives at once", "b, without map"),
    )
