"""The study file of the page on EuRoC, on a tree as `taskslam replay` leaves it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
from typer.testing import CliRunner

from taskslam.cli.app import app
from taskslam.studies.study import load_study

STUDY = Path(__file__).parents[2] / "docs" / "data" / "euroc_fig1.yaml"
ROUNDS = 4
FRAMES = 200


def write(file: Path, scatter: float, seed: int) -> None:
    """A flight round a hall, to the micrometre or off by so much."""
    file.parent.mkdir(parents=True, exist_ok=True)
    along = np.linspace(0, 2 * np.pi, FRAMES)
    off = scatter * np.random.default_rng(seed).standard_normal(3)
    places = np.column_stack([5 * np.cos(along), 3 * np.sin(along), 1 + 0.2 * np.sin(3 * along)]) + off * along[:, None]
    rows = (f"{1400000000 + 0.05 * k:.6f} {x:.6f} {y:.6f} {z:.6f} 0 0 0 1" for k, (x, y, z) in enumerate(places))
    file.write_text("\n".join(rows) + "\n")


def test_its_study_file_finds_what_the_commands_write(tmp_path: Path) -> None:
    shutil.copy(STUDY, tmp_path / STUDY.name)
    names = [line.strip().rstrip(":") for line in STUDY.read_text().splitlines() if line.startswith("  MH_")]
    assert len(names) == 5
    for name in names:
        for method in ("orb_slam3", "gf_gg,features=300"):
            for mode in ("without-map", "with-map"):
                for number in range(ROUNDS + (mode == "with-map")):
                    place = tmp_path / "fig1" / name / method / mode / "seed0" / f"round{number:02d}"
                    write(place / "estimate.tum", 0.01, number)
                    write(place / "truth.tum", 0.0, 0)
    study = load_study(str(tmp_path / STUDY.name))
    for sequence in study.sequences.values():
        assert {method: len(runs) for method, runs in sequence.runs.items()} == dict.fromkeys(
            ("orb_slam3", "orb_slam3 with map", "gf_gg", "gf_gg with map"), ROUNDS
        )
        assert not any("with-map/seed0/round00" in run for runs in sequence.runs.values() for run in runs)
    done = CliRunner().invoke(
        app, ["evaluate-trajectories", str(tmp_path / STUDY.name), "--out", str(tmp_path / "study")]
    )
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "study" / "open_loop.json").read_text())
    first = next(one for one in found["results"] if (one["sequence"], one["method"]) == (names[0], "gf_gg with map"))
    assert first["runs"][0]["completeness"] == FRAMES / study.sequences[names[0]].frames
