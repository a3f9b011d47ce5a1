"""What a campaign says of the rounds and seeds that it needs."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from taskslam.benchmark.campaign.design import design_words, share_of
from taskslam.cli.app import app
from taskslam.errors import InputError


@pytest.mark.parametrize(("text", "share"), [("20%", 0.2), ("0.2", 0.2), (" 7.5 % ", 0.075)])
def test_a_difference_is_read_as_people_write_it(text: str, share: float) -> None:
    assert share_of(text) == pytest.approx(share)


@pytest.mark.parametrize("text", ["", "much", "0%", "-5%", "nan", "5000%", "1e3"])
def test_another_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="expected a difference of E such as 20%"):
        share_of(text)


def test_a_plan_says_how_many_seeds_find_a_difference(tmp_path: Path) -> None:
    tiny = tmp_path / "c.yaml"
    tiny.write_text("name: c\nscenarios: [house]\nmethods: [karto, hector, wheel_odometry]\n")
    done = CliRunner().invoke(
        app, ["campaign", "plan", str(tiny), "--out", str(tmp_path / "o"), "--detect", "20%", "-q"]
    )
    assert done.exit_code == 0, done.output
    assert "to find a difference of 20% of E between any two of 3 methods: " in done.output
    assert "an assumed scatter" in done.output


def test_a_smaller_difference_needs_more(tmp_path: Path) -> None:
    seeds = [int(design_words([], tmp_path, share).split(": ")[1].split()[0]) for share in (0.5, 0.2, 0.1)]
    assert seeds == sorted(seeds)
    assert seeds[0] < seeds[2]
