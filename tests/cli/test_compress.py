"""`taskslam campaign compress` on a folder in which some runs are finished and others are under way."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from taskslam.benchmark.spec import run_folder
from taskslam.cli.app import app
from taskslam.record import find_runs
from taskslam.record.place import partial_folder
from watched import write_watched


def test_finished_runs_are_compressed_and_those_under_way_left(tmp_path: Path) -> None:
    finished, under_way, *_ = write_watched(tmp_path)
    plain = {path: path.read_bytes() for path in tmp_path.rglob("*.tum")}
    done = CliRunner().invoke(app, ["campaign", "compress", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert done.output.startswith("1 runs; ")
    assert find_runs(tmp_path) == [run_folder(tmp_path, finished)]
    assert {path.suffix for path in run_folder(tmp_path, finished).glob("round*/*")} == {".gz"}
    assert list(partial_folder(run_folder(tmp_path, under_way)).glob("round*/*.tum"))
    assert CliRunner().invoke(app, ["campaign", "compress", str(tmp_path), "--undo"]).exit_code == 0
    assert {path: path.read_bytes() for path in tmp_path.rglob("*.tum")} == plain
