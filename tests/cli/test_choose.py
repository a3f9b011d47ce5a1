"""`taskslam choose` on a short tour of the built-in house, with methods that cost nothing."""

import pytest
import typer
from typer.testing import CliRunner

from taskslam.cli.choose import choose
from taskslam.errors import InputError

PLACE = """
name: near
world: {name: house}
start: {x: 0, y: 0, theta: 0}
sequence: {waypoints: [[1.0, 0.0, 0.0]]}
protocol: {pause: 0.2, still_start: 0.2}
"""


def invoke(*arguments):
    app = typer.Typer()
    app.command()(choose)
    return CliRunner().invoke(app, [str(one) for one in arguments], env={"COLUMNS": "120"})


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--tolerance", "2"), "--tolerance 2: expected a number above 0 with mm or cm or m, such as 2cm"),
        (("--tolerance", "2cm", "--budget", "2 weeks"), "--budget 2 weeks: expected a number above 0 with min or h"),
    ],
)
def test_an_amount_needs_its_unit(options, words):
    with pytest.raises(InputError, match=words):
        raise invoke("house", *options).exception


def test_the_budget_ends_a_choice_and_a_larger_one_goes_on(tmp_path):
    place = tmp_path / "near.yaml"
    place.write_text(PLACE)
    common = ("--tolerance", "10cm", "--methods", "wheel_odometry,ground_truth", "--rounds", 2, "--out", tmp_path / "o")
    short = invoke(place, *common, "--budget", "0.0001min", "--quiet")
    assert short.exit_code == 1, short.output
    assert "one seed names nobody" in short.output
    runs = sorted(path.parent for path in (tmp_path / "o").rglob("run.json"))
    kept = [path.stat().st_mtime_ns for path in runs]
    long = invoke(place, *common, "--seeds", 2, "--quiet")
    assert long.exit_code in {0, 1}, long.output
    assert [path.stat().st_mtime_ns for path in runs] == kept  # what was driven is not driven again
    assert len(list((tmp_path / "o").rglob("run.json"))) == 4
    assert "After 2 seeds: " in long.output
    assert "is the best of 2 with a probability of" in long.output
    assert "cores busy" in long.output
    assert "min of one core" in long.output
