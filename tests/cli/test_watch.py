"""`taskslam watch --terminal`, told once into a pipe."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from taskslam.cli.app import app
from taskslam.errors import RecordError
from watched import write_watched


def test_a_campaign_is_told_once_into_a_pipe(tmp_path: Path) -> None:
    write_watched(tmp_path / "out")
    told = CliRunner().invoke(app, ["watch", str(tmp_path / "out"), "--terminal"])
    assert told.exit_code == 0, told.output
    assert "4 runs: 1 finished, 1 under way, 1 could not be driven, 1 waiting" in told.output
    assert "✗!" in told.output
    assert "▸·" in told.output
    assert "house · hector · without-map · seed 0: round 2 of 2 · goal 2 of 12" in told.output
    assert "goal 1 reached, 0.00 cm off" in told.output


def test_a_folder_without_runs_is_no_traceback(tmp_path: Path) -> None:
    assert isinstance(CliRunner().invoke(app, ["watch", str(tmp_path), "--terminal"]).exception, RecordError)
