import pytest

from taskslam.report.page.comparison_view import comparison_views
from taskslam.report.results import read_results


@pytest.fixture
def views(make_run, tmp_path):
    """Three methods, one of them far less repeatable, in one mode."""
    for name, spread in (("close", 0.001), ("far", 0.1), ("further", 0.11)):
        make_run(name, method=name, rounds=8, spread=spread)
    return comparison_views(read_results([tmp_path / "results"]))


def test_the_matrix_reads_row_over_column(views):
    (view,) = views.values()
    cells = {
        (row.label, other.label): cell
        for row, cells in view.rows
        for (other, _), cell in zip(view.rows, cells, strict=True)
    }
    assert cells["close", "far"].kind == "better"
    assert cells["far", "close"].kind == "worse"
    assert cells["far", "further"].kind == "open"
    assert cells["close", "close"].ratio is None
    assert cells["close", "far"].ratio < 0.1
    assert cells["close", "far"].ratio * cells["far", "close"].ratio == pytest.approx(1.0)


def test_the_clearest_pairs_come_first_and_are_counted(views):
    (view,) = views.values()
    assert [pair.told_apart for pair in view.pairs] == [True, True, False]
    assert view.apart == 2
    assert sorted(view.beaten_by("close")) == ["far", "further"]
    assert view.beaten_by("far") == []


def test_one_method_alone_is_compared_with_nobody(make_run, tmp_path):
    make_run()
    assert comparison_views(read_results([tmp_path / "results"])) == {}


def test_references_are_compared_with_nobody(make_run, tmp_path):
    for name, card in (("a", {}), ("b", {}), ("truth", {"kind": "reference"})):
        make_run(name, method=name, card=card)
    (view,) = comparison_views(read_results([tmp_path / "results"])).values()
    assert [method.label for method, _ in view.rows] == ["a", "b"]


def test_a_method_that_completed_nothing_has_no_empty_row(make_run, tmp_path):
    for name, goal in (("a", 2), ("b", 2), ("none", 0)):
        make_run(name, method=name, failed=True, failed_goal=goal)
    (view,) = comparison_views(read_results([tmp_path / "results"])).values()
    assert [method.label for method, _ in view.rows] == ["a", "b"]
    assert view.uncompared == 2
