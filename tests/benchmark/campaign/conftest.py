"""A campaign that takes seconds: short tours through a room without anything in it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

WALLS = ((-3, 0, 0.2, 6), (3, 0, 0.2, 6), (0, -3, 6, 0.2), (0, 3, 6, 0.2))
BOX = "<geometry><box><size>{2} {3} 1</size></box></geometry><pose>{0} {1} 0.5 0 0 0</pose>"


@pytest.fixture
def tour(tmp_path: Path) -> Path:
    """The file of a tour of one goal, which takes a second of simulated time a round."""
    boxes = enumerate(BOX.format(*wall) for wall in WALLS)
    walls = "".join(f"<collision name='c{n}'>{box}</collision><visual name='v{n}'>{box}</visual>" for n, box in boxes)
    (tmp_path / "room.world").write_text(
        "<sdf version='1.6'><world name='w'><model name='walls'><static>1</static>"
        f"<link name='l'>{walls}</link></model></world></sdf>"
    )
    file = tmp_path / "tour.yaml"
    file.write_text(
        f"name: tour\nworld: {{file: {tmp_path / 'room.world'}}}\nfloor_plan: {{resolution: 0.1}}\n"
        "start: {x: 0, y: 0, theta: 0}\nsequence: {waypoints: [[0.3, 0.0, 0.0]]}\n"
        "protocol: {pause: 0.1, still_start: 0.1}\n"
    )
    return file


@pytest.fixture
def write_campaign(tour: Path) -> Callable[..., Path]:
    """`write_campaign(keys)`: the file of a campaign of that tour; further lines as they would stand in it."""

    def write(*lines: str, rounds: int = 2) -> Path:
        file = tour.with_name("campaign.yaml")
        defaults = {"methods": "[wheel_odometry]", "modes": "[without-map]", "scenarios": f"[{tour}]"}
        given = {line.partition(":")[0] for line in lines}
        rest = [f"{key}: {value}" for key, value in defaults.items() if key not in given]
        file.write_text("\n".join(["name: small", f"rounds: {rounds}", *rest, *lines]) + "\n")
        return file

    return write


def recorded(directory: Path) -> dict[str, bytes]:
    """What must be the same bytes, whoever drove: journal and trajectories."""
    files = [directory / "journal.jsonl", *directory.glob("round*/*.tum")]
    return {str(file.relative_to(directory)): file.read_bytes() for file in files}


def taskslam(*words: object, environment: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    """The command line, in a process of its own."""
    command = [sys.executable, "-c", "from taskslam.cli.main import main; main()", *map(str, words)]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=300, env=environment or dict(os.environ), check=False
    )
