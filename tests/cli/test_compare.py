import json
import shutil
import xml.etree.ElementTree as ET

import pytest
import typer
from typer.testing import CliRunner

from taskslam.cli.compare import compare
from taskslam.errors import InputError, RecordError
from taskslam.evaluation import evaluate_runs, write_metrics


def invoke(*arguments, catch=True):
    app = typer.Typer()
    app.command()(compare)
    return CliRunner().invoke(app, [str(a) for a in arguments], env={"COLUMNS": "100"}, catch_exceptions=catch)


def test_the_same_results_pass_and_the_table_fits_100_columns(results):
    result = invoke(results, results)
    assert result.exit_code == 0, result.output
    assert "No regression." in result.output
    assert "completeness" in result.output
    assert all(len(line.rstrip()) <= 100 for line in result.output.splitlines())


def test_a_metrics_file_can_stand_for_its_folder(results):
    path = write_metrics(results, evaluate_runs([results]))
    assert invoke(path, results, "--fail-on", "completeness:-0").exit_code == 0


def test_a_loss_of_completeness_ends_with_1_and_is_written_everywhere(results, tmp_path):
    new = tmp_path / "new"
    shutil.copytree(results, new)
    journal = new / "a" / "journal.jsonl"
    lines = journal.read_text().splitlines(keepends=True)
    lost = [line for line in lines if '"event":"arrival"' in line and '"round":1' in line]
    assert len(lost) == 1
    journal.write_text("".join(line for line in lines if line not in lost))
    files = [tmp_path / name for name in ("summary.md", "gate.xml", "gate.json")]
    outputs = ["--markdown", files[0], "--junit", files[1], "--json", files[2]]
    result = invoke(results, new, "--fail-on", "completeness:-0", *outputs)
    assert result.exit_code == 1
    assert "Regression: synthetic / karto / without-map / seed 0" in result.output
    assert "1 regression" in files[0].read_text()
    assert ET.parse(files[1]).getroot().find(".//failure") is not None
    content = json.loads(files[2].read_text())
    assert content["format"] == "taskslam-compare/1"
    assert [finding["status"] for finding in content["findings"]] == ["regression"]


def test_a_run_that_is_gone_ends_with_1(results, tmp_path):
    new = tmp_path / "new"
    shutil.copytree(results, new)
    (new / "a" / "run.json").write_text("{")
    result = invoke(results, new)
    assert result.exit_code == 1
    assert "Missing: synthetic / karto / without-map / seed 0" in result.output
    assert "run.json" in result.output


@pytest.mark.parametrize("rules", ["speed:+1%", "precision:-10%"])
def test_wrong_rules_are_an_error_of_the_user(results, rules):
    with pytest.raises(InputError, match="--fail-on") as caught:
        invoke(results, results, "--fail-on", rules, catch=False)
    assert caught.value.exit_status == 2


def test_wrong_files_are_an_error_of_the_user(results, tmp_path):
    (tmp_path / "metrics.json").write_text('{"format": "taskslam-metrics/1", "runs": []}')
    with pytest.raises(RecordError, match=r"metrics\.json: expected 'taskslam-metrics/4'") as caught:
        invoke(tmp_path / "metrics.json", results, catch=False)
    assert caught.value.exit_status == 2
    with pytest.raises(RecordError, match="no such folder"):
        invoke(tmp_path / "absent", results, catch=False)
