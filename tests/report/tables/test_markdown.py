import pytest

from taskslam.report.results import read_results
from taskslam.report.tables.markdown import methods_markdown


def rows_of(text):
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in text.splitlines() if line[:1] == "|"]


@pytest.fixture
def results(make_run, tmp_path):
    make_run("a", method="karto", spread=0.002)
    make_run("b", method="karto", mode="with-map", spread=0.004)
    make_run("c", method="a|b", spread=0.02, failed=True)
    make_run("d", method="ground_truth", spread=0.0001, card={"kind": "reference"}.items())
    make_run("e", method="karto", scenario="elsewhere", title="Another | place", rounds=2)
    return read_results([tmp_path / "results"])


def test_each_scenario_has_a_table_of_its_own_with_the_best_method_first(results):
    elsewhere, house = methods_markdown(results).split("**Test house**")
    assert elsewhere.startswith("**Another \\| place**")
    assert [row[0] for row in rows_of(elsewhere)[2:]] == ["`karto`"]
    assert [(row[0], row[2]) for row in rows_of(house)[2:]] == [
        ("`karto`", "without map"),
        ("`karto`", "with map"),
        ("`a\\|b`", "without map"),
        ("`ground_truth` (reference)", "without map"),
    ]


def test_a_row_holds_what_the_run_measured(results):
    head, _, row, *_ = rows_of(methods_markdown(results).split("**Test house**")[1])
    (run,) = (r.metrics for r in results.runs if r.metrics.directory == "a")
    cells = dict(zip(head, row, strict=True))
    assert cells["complete"] == "3/3"
    assert float(cells["E, cm"].split()[0]) == pytest.approx(100 * run.position.precision_m, abs=0.005)
    assert float(cells["N-AUC"].split()[0]) == pytest.approx(run.n_auc.exact, abs=5e-4)


def test_failures_are_said_and_what_is_not_defined_is_a_dash(results):
    head, _, *rows = rows_of(methods_markdown(results).split("**Test house**")[1])
    failed, fine = rows[2], rows[0]
    assert failed[head.index("failures")] == "no path to the goal (1×)"
    assert fine[head.index("failures")] == "–"
