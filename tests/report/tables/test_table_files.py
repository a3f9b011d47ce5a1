import csv

import pytest

from taskslam.errors import InputError, RecordError
from taskslam.report.results import read_results
from taskslam.report.tables.latex import escape, methods_latex, waypoints_latex
from taskslam.report.tables.layout import Layout
from taskslam.report.tables.table_files import write_tables

NASTY = r"a_b & 100% $x^2$ #1 {c} ~ \end{tabular}"


def cells_of(latex):
    """Rows of a snippet as lists of cells."""
    rows = [line[: -len(r" \\")] for line in latex.splitlines() if line.endswith(r"\\")]
    return [row.replace(r"\&", "and").split(" & ") for row in rows if not row.startswith(r"\multicolumn")]


@pytest.fixture
def results(make_run, tmp_path):
    card = {"kind": "reference"}.items()
    make_run("a", method="karto", spread=0.002)
    make_run("b", method=NASTY, spread=0.02, failed=True)
    make_run("c", method="ground_truth", spread=0.0001, card=card)
    make_run("d", method="karto", mode="with-map", spread=0.004)
    return read_results([tmp_path / "results"])


def test_any_text_is_escaped():
    assert escape("a_b & 50 %\n") == r"a\_b \& 50 \% "
    assert escape("\\{}~^") == r"\textbackslash{}\{\}\textasciitilde{}\textasciicircum{}"


def test_every_row_has_as_many_cells_as_columns_and_braces_balance(results):
    for latex in (methods_latex(results), *(waypoints_latex(results, name) for name in results.scenarios)):
        for block in latex.split(r"\end{tabular}")[:-1]:
            columns = block.split(r"\begin{tabular}{")[1].split("}")[0]
            assert {len(row) for row in cells_of(block)} == {len(columns)}
        plain = latex.replace(r"\{", "").replace(r"\}", "")
        assert plain.count("{") == plain.count("}")
        assert r"\end{tabular}" not in escape(NASTY)


def test_the_most_complete_method_is_in_bold_and_the_reference_never(results):
    lines = methods_latex(results).splitlines()
    karto, nasty, truth = (
        next(line for line in lines if line.startswith(start)) for start in ("karto", "a", r"\emph{g")
    )
    assert r"\textbf{100}" in karto
    assert r"\textbf" not in nasty
    assert r"\textbf" not in truth


def test_a_missed_waypoint_is_a_dash_and_its_mean_underlined(results):
    row = next(line for line in waypoints_latex(results, "synthetic").splitlines() if line.startswith(" & a"))
    assert " & -- & " in row
    assert r"\underline{" in row


def test_csv_holds_one_row_a_waypoint_with_numbers_as_they_are(results, tmp_path):
    write_tables(results, tmp_path / "out")
    with (tmp_path / "out" / "waypoints.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    first = results.runs[0].metrics.waypoints[0]
    row = next(row for row in rows if row["method"] == results.runs[0].label and row["waypoint"] == "1")
    assert float(row["precision_m"]) == first.position.precision_m
    with (tmp_path / "out" / "failures.csv").open(encoding="utf-8", newline="") as file:
        failures = list(csv.DictReader(file))
    assert [(row["method"], row["outcome"], row["waypoint"]) for row in failures] == [(NASTY, "no_plan", "3")]


def test_the_document_inputs_every_snippet(results, tmp_path):
    paths = {path.name for path in write_tables(results, tmp_path / "out")}
    document = (tmp_path / "out" / "tables.tex").read_text(encoding="utf-8")
    for name in paths - {"tables.tex"}:
        assert (f"\\input{{{name}}}" in document) == name.endswith(".tex")


def test_one_round_has_tables_too(make_run, tmp_path):
    make_run("a", rounds=1)
    single = read_results([tmp_path / "results"])
    assert " & -- & " in methods_latex(single)
    assert len(write_tables(single, tmp_path / "out")) == 7


def test_without_a_run_that_can_be_used_there_is_no_table(make_run, tmp_path):
    (make_run() / "run.json").write_text("nonsense")
    with pytest.raises(RecordError, match="none of the runs can be used"):
        write_tables(read_results([tmp_path / "results"]), tmp_path / "tables")
    assert not (tmp_path / "tables").exists()


def test_a_table_has_the_columns_that_are_asked_for(results):
    layout = Layout().with_columns(["N-AUC", "C", "failures", "RTF"])
    head, *rows = cells_of(methods_latex(results, layout))
    assert [cell.split(" ")[0] for cell in head] == ["method", "N-AUC", "$C$", "failures", "RTF"]
    assert {len(row) for row in rows} == {5}
    assert "$E$" not in methods_latex(results, layout)
    assert Layout().with_columns([]) == Layout()
    with pytest.raises(InputError, match=r"column NAUC: expected some of .*C, E, .*Did you mean 'N-AUC'"):
        Layout().with_columns(["NAUC"])


def test_methods_are_called_and_ordered_as_their_authors_ask(results, tmp_path):
    folder = [tmp_path / "results"]
    ours = read_results(folder, {"karto": "Ours"}, ["ground_truth", "karto"])
    assert [method.label for method in ours.methods] == ["ground_truth", "Ours", NASTY]
    assert [result.label for result in ours.in_mode("without-map")] == ["ground_truth", "Ours", NASTY]
    assert [method.label for method in ours.in_scenario("synthetic").methods] == ["ground_truth", "Ours", NASTY]
    assert "karto" not in methods_latex(ours)
    assert read_results(folder, {"karto": "Ours"}, ["Ours"]).methods[0].label == "Ours"
    with pytest.raises(InputError, match=r"label kartp: no method is called so here; .*Did you mean 'karto'"):
        read_results(folder, {"kartp": "Ours"})
    with pytest.raises(InputError, match="order Ours: no method is called so here"):
        read_results(folder, {}, ["Ours"])
    with pytest.raises(InputError, match="label karto=ground_truth: ground_truth is called so too"):
        read_results(folder, {"karto": "ground_truth"})
