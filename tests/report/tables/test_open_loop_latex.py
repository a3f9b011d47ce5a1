from recorded import write_study
from taskslam.report.tables.open_loop_latex import open_loop_latex
from taskslam.studies.study import load_study
from taskslam.studies.study_evaluation import evaluate_study


def test_every_method_on_a_sequence_is_a_row_and_the_best_is_bold(tmp_path):
    study = load_study(str(write_study(tmp_path)))
    results = evaluate_study(study, study.settings)
    lines = open_loop_latex(results).splitlines()
    rows = [line for line in lines if line.endswith(r"\\")]
    columns = {line.count(" & ") + 1 for line in rows}
    assert columns == {3 + 2 + 2 * 3 + 3}
    assert lines[2] == f"\\begin{{tabular}}{{ll{'r' * 12}}}"
    assert [row.split(" & ")[:3] for row in rows[1:4]] == [
        ["MH\\_08", "\\textless{}b\\textgreater{}odd", "1"], ["", "orb", "4"], ["", "vins", "5"],
    ]  # fmt: skip
    (orb,) = [one for one in results.results if (one.sequence, one.method) == ("MH_08", "orb")]
    cell = rows[2].split(" & ")[3]
    assert cell.startswith(f"\\textbf{{{100 * orb.ate_m.value:.2f}}} {{\\scriptsize [{100 * orb.ate_m.low:.2f}--")
    assert "\\textbf" not in rows[3].split(" & ")[3]
