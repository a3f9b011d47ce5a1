"""Long verbs that are told to stop: in words, with all put away, and so that the next start goes on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from small_tour import write_tour

ROUNDS = 60


@pytest.fixture
def tour(tmp_path: Path) -> Path:
    """Many short rounds in a room without anything in it."""
    file = write_tour(tmp_path, [[0.3, 0.0, 0.0]], f"rounds: {ROUNDS}, pause: 0.1, still_start: 0.1")
    (tmp_path / "suite.yaml").write_text(
        f"name: s\nscenarios: [{file}]\nseeds: [0]\nmethods: [karto]\nrounds: {ROUNDS}\n"
    )
    return file


def start(tmp_path: Path, *arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", "from taskslam.cli.main import main; main()", *map(str, arguments)]
    (tmp_path / "scratch").mkdir(exist_ok=True)
    environment = {**os.environ, "TMPDIR": str(tmp_path / "scratch")}
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)


def wait_for(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + 120
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.01)


def rounds_ended(folder: Path) -> int:
    return sum(journal.read_bytes().count(b"round_ended") for journal in folder.rglob(".*.partial/**/journal.jsonl"))


@pytest.mark.parametrize(
    ("verb", "number"), [("run", signal.SIGINT), ("run", signal.SIGHUP), ("suite", signal.SIGTERM)]
)
def test_a_drive_that_is_stopped_is_gone_on_with(verb: str, number: signal.Signals, tour: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = {
        "run": ("run", tour, "-m", "karto", "--mode", "without-map", "--out", out),
        "suite": ("suite", tmp_path / "suite.yaml", "--modes", "without-map", "--out", out),
    }[verb]
    process = start(tmp_path, *arguments)
    wait_for(lambda: rounds_ended(out) > 1)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 128 + number, said
    assert f"stopped by {number.name}; what is finished is kept, start again to go on" in said
    assert "Traceback" not in said
    if verb == "run":
        assert "rounds ended, after which the next start goes on" in said
    else:
        assert "0 of 1 runs are finished" in said
        workers = subprocess.run(["pgrep", "-f", f"engines.worker {process.pid}"], capture_output=True, text=True)
        assert workers.stdout == ""
    assert list((tmp_path / "scratch").iterdir()) == []
    assert [path.name for path in (out / "tour" / "karto" / "without-map").iterdir()] == [".seed0.partial"]
    kept = rounds_ended(out)
    again = start(tmp_path, *arguments)
    wait_for(lambda: rounds_ended(out) > kept + 1)
    again.terminate()
    again.communicate(timeout=60)
    assert rounds_ended(out) > kept


def test_an_export_that_is_stopped_leaves_nothing(tour: Path, tmp_path: Path) -> None:
    out = tmp_path / "datasets" / "set"
    tour.write_text(
        tour.read_text().replace("[[0.3, 0.0, 0.0]]", "[[1.5, 0.0, 0.0], [-1.5, 0.0, 0.0], [1.5, 1.5, 0.0]]")
    )
    process = start(tmp_path, "export", tour, "--out", out, "--format", "mcap", "-m", "karto")
    wait_for(lambda: list(out.parent.rglob("journal.jsonl")))
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM, said
    assert f"Nothing is kept of {out}" in said
    assert list(out.parent.iterdir()) == []
    assert list((tmp_path / "scratch").iterdir()) == []
