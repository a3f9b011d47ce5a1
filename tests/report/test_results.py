import re

import pytest

from taskslam.errors import RecordError
from taskslam.report import write_report
from taskslam.report.results import read_results
from taskslam.report.tables.table_files import methods_csv


def test_methods_are_ranked_by_completeness_then_precision_and_references_last(make_run, tmp_path):
    make_run("a", method="ground_truth", spread=0.0001, card={"kind": "reference"}.items())
    make_run("b", method="coarse", spread=0.02)
    make_run("c", method="fine", spread=0.002)
    make_run("d", method="incomplete", spread=0.001, failed=True)
    results = read_results([tmp_path / "results"])
    order = ["fine", "coarse", "incomplete", "ground_truth"]
    assert [result.label for result in results.in_mode("without-map")] == order
    assert [method.label for method in results.methods] == order
    assert all(method.with_map is None for method in results.methods)
    assert results.modes == ("without-map",)


def test_a_sequence_that_only_others_drove_stays_in_the_denominator(make_run, tmp_path):
    make_run("a", method="karto")
    make_run("b", method="karto", scenario="second")
    make_run("c", method="hector")
    hector = next(result for result in read_results([tmp_path / "results"]).pooled if result.label == "hector")
    assert hector.missing == (3,)
    assert not hector.complete
    assert hector.pooled.completeness == 0.5


def test_the_page_and_the_tables_list_methods_in_the_same_order(make_run, tmp_path):
    for name, spread, card in (("truth", 0.0001, {"kind": "reference"}), ("far", 0.05, {}), ("near", 0.001, {})):
        make_run(name, method=name, spread=spread, card=card)
    page = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    table = methods_csv(read_results([tmp_path / "results"]))
    listed = re.findall(r'class="text who">.*?<b>(\w+)</b>', page)[:3]
    assert listed == [line.split(",")[0] for line in table.splitlines()[1:]] == ["near", "far", "truth"]


def test_the_first_run_of_a_method_stands_for_it_in_the_order_of_folders(make_run, tmp_path):
    for name, method in (("1", "a"), ("2", "b"), ("3", "a")):
        make_run(name, method=method, scenario=f"of {name}")
    runs = read_results([tmp_path / "results"]).first_runs
    assert [(run.label, run.metrics.scenario) for run in runs] == [("a", "of 1"), ("b", "of 2")]


def test_a_folder_without_runs_is_refused(tmp_path):
    with pytest.raises(RecordError, match="holds no run"):
        read_results([tmp_path])
