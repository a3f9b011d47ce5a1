"""A campaign that takes seconds: short tours through a room without anything in it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from small_tour import write_tour


@pytest.fixture
def tour(tmp_path: Path) -> Path:
    """The file of a tour of one goal, which takes a second of simulated time a round."""
    return write_tour(tmp_path, [[0.3, 0.0, 0.0]], "pause: 0.1, still_start: 0.1")


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
