"""The table of runs: a copy of what run directories say, which can always be made again."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from taskslam.cli.app import app
from taskslam.errors import InputError, RecordError
from taskslam.evaluation import evaluate_runs, run_index
from taskslam.evaluation.run_index import INDEX_FILE, chosen, index_runs

pytest.importorskip("polars")
TOOL = Path(__file__).parents[2] / "tools" / "make_synthetic_runs.py"


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    folder = tmp_path / "runs"
    subprocess.run([sys.executable, TOOL, folder, "--runs", "8"], check=True, stdout=subprocess.DEVNULL)
    return folder


def test_a_row_says_what_evaluation_says(runs: Path) -> None:
    table = index_runs(runs).table
    for row, metrics in zip(table.iter_rows(named=True), evaluate_runs([runs]).runs, strict=True):
        assert row["directory"] == metrics.directory
        assert row["completeness"] == metrics.completeness
        assert row["precision_cm"] == pytest.approx(100 * (metrics.position.precision_m or 0))
        assert (row["method"], row["seed"], row["mode"]) == (metrics.method, metrics.seed, metrics.mode)


def test_only_what_is_new_or_has_changed_is_read(runs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = index_runs(runs).table
    read: list[str] = []
    load = run_index.load_run
    monkeypatch.setattr(run_index, "load_run", lambda path, damaged: read.append(path.name) or load(path, damaged))
    assert index_runs(runs).table.equals(first)
    assert read == []
    changed = runs / "000" / "seed3" / "run.json"
    changed.write_text(json.dumps(json.loads(changed.read_text()) | {"wall_s": 17.0}))
    (runs / "000" / "seed5").rename(runs / "seed5")
    table = index_runs(runs).table
    assert sorted(read) == ["seed3", "seed5"]
    assert table.filter(table["seed"] == 3)["wall_s"].to_list() == [17.0]
    assert len(table) == 8


@pytest.mark.parametrize("damage", [b"", b"no parquet", None])
def test_an_index_that_is_damaged_or_gone_is_built_again(damage: bytes | None, runs: Path) -> None:
    first = index_runs(runs).table
    if damage is None:
        (runs / INDEX_FILE).unlink()
    else:
        (runs / INDEX_FILE).write_bytes(damage)
    assert index_runs(runs).table.equals(first)
    assert (runs / INDEX_FILE).stat().st_size > 1000


def test_a_run_that_cannot_be_read_is_named_and_the_rest_is_listed(runs: Path) -> None:
    (runs / "000" / "seed2" / "run.json").write_text("{")
    found = index_runs(runs)
    assert len(found.table) == 7
    (left,) = found.left_out
    assert left.directory == "000/seed2"
    with pytest.raises(RecordError, match="holds no finished run"):
        index_runs(runs / "000" / "seed2" / "nothing")


def test_a_condition_chooses_rows_and_a_wrong_one_is_refused(runs: Path) -> None:
    table = index_runs(runs).table
    assert chosen(table, "method = 'synthetic_1' and seed > 1")["seed"].to_list() == [5]
    for wrong in ("metod = 'karto'", "seed >", "seed + 1", "read_csv('/etc/passwd')"):
        with pytest.raises(InputError, match="expected a condition on the columns"):
            chosen(table, wrong)


def test_the_command_lists_groups_and_exports(runs: Path, tmp_path: Path) -> None:
    def taskslam(*words: object) -> str:
        done = CliRunner().invoke(app, ["runs", str(runs), *map(str, words)])
        assert done.exit_code == 0, done.exception
        return done.output

    assert "8 lines" in taskslam()
    assert "4 lines" in taskslam("--by", "method", "--export", tmp_path / "methods.csv")
    assert (tmp_path / "methods.csv").read_text().startswith("method,runs,complete,")
    assert "2 lines" in taskslam("--where", "method = 'synthetic_0'", "--export", tmp_path / "some.parquet")
    assert "of which 3 are shown" in taskslam("--most", 3, "--sort", "-precision_cm")
    wrong = CliRunner().invoke(app, ["runs", str(runs), "--sort", "precison_cm"])
    assert "Did you mean 'precision_cm'" in str(wrong.exception)
