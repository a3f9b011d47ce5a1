"""The overview of a suite, on synthetic runs of three waypoints each."""

import re
from html.parser import HTMLParser

import pytest

from taskslam.evaluation.quantities import quantities
from taskslam.report import write_report
from taskslam.report.page.suite import is_suite, suite_view
from taskslam.report.page.views import run_view, scenario_view
from taskslam.report.results import read_results

ODOMETRY = {"kind": "odometry", "map_mode": "none", "licence": "GPL-3.0", "deterministic": False}


COLUMNS = 6 + len(quantities())


class Rows(HTMLParser):
    """The text of every table row, cell by cell."""

    def __init__(self, text):
        super().__init__()
        self.rows = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        if tag == "tr":
            self.rows.append([])
        if tag in {"td", "th"}:
            self.rows[-1].append("")

    def handle_data(self, data):
        if self.rows and self.rows[-1]:
            self.rows[-1][-1] = " ".join(f"{self.rows[-1][-1]} {data}".split())


@pytest.fixture
def three_methods(make_run, tmp_path):
    """karto twice, hector with a failure in the house, kiss_icp in the house only; the hall has no other mode."""
    make_run("house/karto", scenario="house", title="House")
    make_run("hall/karto", scenario="hall", title="Hall")
    make_run("house/hector", method="hector", scenario="house", title="House", failed=True)
    make_run("hall/hector", method="hector", scenario="hall", title="Hall", spread=0.03)
    make_run("house/kiss_icp", method="kiss_icp", scenario="house", title="House", spread=0.05, card=ODOMETRY)
    return tmp_path / "results"


@pytest.fixture
def page(three_methods, tmp_path):
    return write_report([three_methods], tmp_path / "out" / "report.html").read_text()


def suite(folder):
    results = read_results([folder])
    runs = [run_view(f"run-{index}", run) for index, run in enumerate(results.runs)]
    return suite_view(
        results,
        [scenario_view([run for run in runs if run.metrics.scenario == name], True) for name in results.scenarios],
    )


def test_a_run_that_a_method_lacks_stays_in_its_denominator(three_methods):
    by_name = {result.label: result.pooled for result in read_results([three_methods]).in_mode("without-map")}
    assert by_name["karto"].completeness == 1.0
    assert by_name["hector"].completeness == pytest.approx(5 / 6)
    assert by_name["kiss_icp"].completeness == pytest.approx(3 / 6)
    assert by_name["kiss_icp"].area.exact < 0.5


def test_the_table_is_ordered_by_completeness_and_says_what_is_missing(page):
    rows = [row for row in Rows(page).rows if len(row) == COLUMNS][1:]
    assert [row[0].split()[0] for row in rows] == ["karto", "hector", "kiss_icp"]
    assert [row[1] for row in rows] == ["2 of 2 one seed", "2 of 2 one seed", "1 of 2 one seed"]
    assert [row[2] for row in rows] == ["6/6", "5/6", "3/6"]
    assert [row[3].split()[0] for row in rows] == ["100", "83", "50"]
    assert rows[1][-3] == "no path to the goal (1×)"


def test_at_equal_completeness_the_more_precise_method_comes_first(make_run, tmp_path):
    for name, spread in (("a", 0.03), ("b", 0.001), ("c", 0.01)):
        make_run(name, method=name, spread=spread)
    results = read_results([tmp_path / "results"])
    assert [result.label for result in results.in_mode("without-map")] == ["b", "c", "a"]


def test_known_limits_are_printed_with_the_result(page):
    row = next(row for row in Rows(page).rows if len(row) == COLUMNS and row[0].startswith("kiss_icp"))
    assert row[0] == "kiss_icp odometry only · no map reuse · not deterministic · GPL"


def test_the_overview_comes_first_and_every_scenario_has_a_section(page):
    title = page.index("<h1>3 methods in 2 scenarios</h1>")
    assert (
        title < page.index("<h2>Cumulative precision</h2>") < page.index("<h2>Hall</h2>") < page.index("<h2>House</h2>")
    )
    assert page.count("<h1>") == 1


def test_with_more_than_four_runs_each_is_folded_away(page):
    assert page.count('<details class="run"') == 5


def test_few_runs_stay_open(make_run, tmp_path):
    for name in "abc":
        make_run(name, method=name)
    text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    assert '<details class="run"' not in text
    assert "<h1>Test house</h1>" in text
    assert "TaskSLAM-Bench · 3 methods<" in text


def test_two_methods_in_one_scenario_are_no_suite(make_run, tmp_path):
    make_run("a", method="a")
    make_run("b", method="b", mode="with-map")
    assert not is_suite(read_results([tmp_path / "results"]))
    assert 'class="findings' not in write_report([tmp_path / "results"], tmp_path / "r.html").read_text()


def test_a_failure_bears_the_same_number_on_the_plan_and_at_its_story(page):
    story = re.search(r'<details class="story".*?</summary>', page, re.DOTALL).group(0)
    assert '<span class="kind">1</span>' in story
    assert "hector, without map" in story
    assert "round 3, waypoint 3" in story
    assert re.search(r'<text [^>]*class="halo">1</text>', page)


def test_options_tell_variants_of_a_method_apart(make_run, tmp_path):
    make_run("a")
    make_run("b", method_options={"range": 8})
    make_run("c", method_options={"range": 9})
    assert {run.label for run in read_results([tmp_path / "results"]).runs} == {
        "karto (default options)",
        "karto (range = 8)",
        "karto (range = 9)",
    }


def test_completeness_of_both_modes_stands_at_the_violin(make_run, tmp_path):
    make_run("a", failed=True)
    make_run("b", mode="with-map")
    make_run("c", method="other")
    make_run("d", method="third")
    labels = {method.label: method.completeness_label for method in read_results([tmp_path / "results"]).methods}
    assert labels == {"karto": "(67 | 100)", "other": "(100 | –)", "third": "(100 | –)"}


def test_scenarios_with_different_robots_share_no_robot_diameter(make_run, tmp_path):
    make_run("a", scenario="a")
    make_run("b", scenario="b")
    manifest = tmp_path / "results" / "b" / "run.json"
    changed = manifest.read_text().replace('"robot": "turtlebot2"', '"units": {"robot_diameter": 0.5}')
    manifest.write_text(changed)
    assert read_results([tmp_path / "results"]).units.diameter_m is None
    assert " D</text>" not in str(suite(tmp_path / "results").curves[0].figure)


def test_different_configurations_under_one_name_are_pointed_out(make_run, tmp_path):
    make_run("a", scenario="a")
    make_run("b", scenario="b")
    make_run("c", scenario="b", method="other", scenario_hash="cd" * 32)
    text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    assert text.count("2 different configurations of this scenario") == 1


@pytest.mark.parametrize("options", [{"rounds": 1}, {"truth": False}, {"plan": False}, {"failed": True, "rounds": 1}])
def test_runs_that_lack_something_still_make_an_overview(make_run, tmp_path, options):
    for name in "abc":
        make_run(name, method=name, **options)
    text = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    assert not re.search(r"\b(nan|inf|None)\b", re.sub(r"base64,[^\"]+", "", text))
    assert "All methods" in text
