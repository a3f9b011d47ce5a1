"""`taskslam campaign tables`: one command makes the tables of a page from a campaign's folder."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from taskslam.cli.app import app
from watched import drive_round, manifest, write_watched, writer


def test_tables_say_mode_robot_latency_and_seeds_and_what_is_left(tmp_path: Path) -> None:
    write_watched(tmp_path / "out")
    printed = CliRunner().invoke(app, ["campaign", "tables", str(tmp_path / "out")])
    assert printed.exit_code == 0, printed.output
    (row,) = [line for line in printed.output.splitlines() if line.startswith("| `karto`")]
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[2:7] == ["without map", "`turtlebot2`", "`fixed`", "one seed", "11/12"]
    assert (
        "`watched`, 1 of 4 runs are driven. Left, with the price in hours of one core: `hector` 2 runs"
        in printed.output
    )
    page = tmp_path / "page.md"
    page.write_text("<!-- tables of watched -->\n<!-- end of tables of watched -->\n")
    done = CliRunner().invoke(app, ["campaign", "tables", str(tmp_path / "out"), "--into", str(page)])
    assert done.exit_code == 0, done.output
    assert row in page.read_text()


def test_a_run_that_others_have_and_a_method_has_not_yet_is_no_miss_of_its(tmp_path: Path) -> None:
    _, hector, karto, _ = write_watched(tmp_path / "out")
    for spec in (hector, karto):  # now karto has both seeds, hector one
        with writer(tmp_path / "out", spec) as run:
            for number in range(run.resumed.rounds, 2):
                drive_round(run, spec, number)
            run.finish(manifest(spec))
    printed = CliRunner().invoke(app, ["campaign", "tables", str(tmp_path / "out")]).output
    rows = {line.split("`")[1]: line for line in printed.splitlines() if line.startswith("| `")}
    assert "| one seed | 12/12 |" in rows["hector"]
    assert "| 2 seeds | 23/24 |" in rows["karto"]
