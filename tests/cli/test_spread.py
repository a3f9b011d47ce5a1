"""`taskslam spread` on a tour of a second: a method that draws lots, and one that never differs but by noise."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import Result
from typer.testing import CliRunner

from small_tour import write_tour
from taskslam.cli.app import app
from taskslam.errors import InputError


def spread(*words: object) -> Result:
    return CliRunner().invoke(app, ["spread", *map(str, words)])


def test_all_of_a_deterministic_methods_spread_is_noise(tmp_path: Path) -> None:
    tour = write_tour(tmp_path, [[0.3, 0.0, 0.0]], "pause: 0.1, still_start: 0.1")
    words = (
        tour,
        "-m",
        "wheel_odometry",
        "--runs",
        2,
        "--groups",
        1,
        "--rounds",
        2,
        "--out",
        tmp_path / "out",
        "--quiet",
    )
    done = spread(*words)
    assert done.exit_code == 0, done.output
    rows = {line.split("  ")[0].strip(): line for line in done.output.splitlines()}
    assert "100%" in rows["sensor noise"]
    assert " 0%" in rows["threads"]
    assert "over 2 runs in which everything differs" in done.output
    runs = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("run.json")}
    assert len(runs) == 4
    again = spread(*words)
    assert again.output == done.output
    assert {path: path.stat().st_mtime_ns for path in runs} == runs  # nothing is driven twice


def test_too_few_runs_for_their_groups_are_refused() -> None:
    with pytest.raises(InputError, match="--runs 3 --groups 2: 3 runs in 2 groups; expected at least two in each"):
        raise spread("house", "-m", "wheel_odometry", "--runs", 3).exception
