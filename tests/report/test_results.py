import pytest

from taskslam.errors import RecordError
from taskslam.report.results import read_results


def test_methods_are_ranked_by_completeness_then_precision_and_references_last(make_run, tmp_path):
    make_run("a", method="ground_truth", spread=0.0001, card={"kind": "reference"}.items())
    make_run("b", method="coarse", spread=0.02)
    make_run("c", method="fine", spread=0.002)
    make_run("d", method="incomplete", spread=0.001, failed=True)
    results = read_results([tmp_path / "results"])
    order = ["fine", "coarse", "incomplete", "ground_truth"]
    assert [result.label for result in results.in_mode("without-map")] == order
    assert [method[0].label for method in results.methods()] == order
    assert all(method[1] is None for method in results.methods())
    assert results.modes == ("without-map",)


def test_a_sequence_that_only_others_drove_stays_in_the_denominator(make_run, tmp_path):
    make_run("a", method="karto")
    make_run("b", method="karto", scenario="second")
    make_run("c", method="hector")
    hector = next(result for result in read_results([tmp_path / "results"]).pooled if result.label == "hector")
    assert hector.missing == (3,)
    assert not hector.complete
    assert hector.pooled.completeness == 0.5


def test_a_folder_without_runs_is_refused(tmp_path):
    with pytest.raises(RecordError, match="holds no run"):
        read_results([tmp_path])
