import json

import pytest
import typer
from typer.testing import CliRunner

from taskslam.cli.evaluate import evaluate


def invoke(*arguments, columns="100"):
    app = typer.Typer()
    app.command()(evaluate)
    return CliRunner().invoke(app, [str(argument) for argument in arguments], env={"COLUMNS": columns})


def test_tables_are_shown_and_metrics_written(results):
    result = invoke(results)
    assert result.exit_code == 0, result.output
    content = json.loads((results / "metrics.json").read_text())
    assert content["runs"][0]["completeness"] == 0.5
    assert content["runs"][0]["position"]["precision_m"] == pytest.approx(0.1)
    assert "karto" in result.output
    assert "1/2" in result.output
    assert "10.00" in result.output
    assert "lost  round 2, waypoint 2" in result.output
    assert str(results / "metrics.json") in result.output


def test_the_summary_alone_fits_100_columns(results):
    result = invoke(results, "--no-waypoints")
    assert "estimation cm" not in result.output
    tables = [line for line in result.output.splitlines() if "karto" in line]
    assert len(tables) == 2
    assert all(len(line.rstrip()) <= 100 for line in tables)
    assert "method MB" in result.output
    assert tables[1].rstrip().endswith(" 312")


def test_on_a_narrow_screen_intervals_go_and_names_stay(results):
    wide, middle, narrow = (invoke(results, "--no-waypoints", columns=n).output for n in ("190", "100", "80"))
    row = {output: next(line for line in output.splitlines() if "karto" in line) for output in (wide, middle, narrow)}
    assert ["[" in row[output] for output in (wide, middle, narrow)] == [True, False, False]
    assert ["E_SLAM" in output for output in (wide, middle, narrow)] == [True, True, False]
    rows = [line for line in narrow.splitlines() if "karto" in line]
    assert len(rows) == 2
    assert all(len(line) <= 80 for line in rows)
    assert "…" not in narrow


def test_a_pipe_has_no_edge(results):
    printed = invoke(results, "--no-waypoints", columns=None).output
    assert "95 % interval" in printed
    assert "E_SLAM" in printed
    assert "…" not in printed


def test_the_published_definitions_can_be_asked_for(results):
    assert invoke(results, "--upstream-compat").exit_code == 0
    assert json.loads((results / "metrics.json").read_text())["definitions"] == "upstream"


def test_a_run_that_cannot_be_read_is_named_and_left_out(results):
    (results / "b").mkdir()
    (results / "b" / "run.json").write_text("{")
    result = invoke(results)
    assert result.exit_code == 0
    assert "Left out" in result.output
    assert "run.json" in result.output
    assert len(json.loads((results / "metrics.json").read_text())["runs"]) == 1


def test_published_and_right_numbers_are_shown_with_their_difference(results):
    result = invoke(results, "--no-waypoints", "--deviations", "unclipped-arccos")
    assert "The published code gives the same numbers" in result.output
    content = json.loads((results / "metrics.json").read_text())
    assert content["deviations"] == ["unclipped-arccos"]
    assert content["runs"][0]["by_definition"]["completeness"] == 0.5


def test_a_deviation_that_shows_is_a_row_of_the_table(results):
    journal = results / "a" / "journal.jsonl"
    journal.write_text(journal.read_text().replace('"truth":[0.9,2.0,0.0]', '"truth":[0.9,2.0,0.2]'))
    result = invoke(results, "--no-waypoints", "--upstream-compat")
    assert "as published  by definition  difference" in result.output
    assert "precision °" in result.output.split("as published  by definition")[1]


def test_names_and_reasons_of_a_run_do_not_act_on_the_terminal(results):
    evil = "\\u001b[31mred\\u001b]0;owned\\u0007[bold]\\u202e"
    (manifest,), (journal,) = results.rglob("run.json"), results.rglob("journal.jsonl")
    manifest.write_text(manifest.read_text().replace('"method": "karto"', f'"method": "karto {evil}"'))
    journal.write_text(journal.read_text().replace('"detail":"', f'"detail":"{evil}'))
    result = invoke(results, columns="200")
    assert result.exit_code == 0, result.output
    assert "karto red" in result.output
    assert "[bold]" in result.output
    assert not any(letter in result.output for letter in "\x1b\x07\u202e")


def test_a_folder_whose_name_is_no_text_is_evaluated(results):
    (run,) = results.rglob("run.json")
    run.parent.rename(run.parent.with_name("caf\udce9"))
    result = invoke(results)
    assert result.exit_code == 0, result.output
    assert "caf\ufffd" in (results / "metrics.json").read_text()
