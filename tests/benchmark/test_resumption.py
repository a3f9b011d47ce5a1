"""A run that is killed goes on with the first round that had not ended, and leaves the bytes of one that was not."""

from __future__ import annotations

import os
import random
import signal
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest

from taskslam.benchmark.run import run
from taskslam.benchmark.spec import RunSpec, run_folder
from taskslam.benchmark.stage import Stage
from taskslam.errors import HostFailedError
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.record import load_run
from taskslam.record.place import partial_folder
from taskslam.record.run_directory import JOURNAL
from taskslam.slam.guest.host import MethodHost

NEAR = [[-1.2, -1.0, 0.0], [-1.0, -0.6, 1.5]]


class Notices(Observer):
    def __init__(self) -> None:
        self.heard: list[str] = []

    def notice(self, text: str) -> None:
        self.heard.append(text)


def recorded(directory: Path) -> dict[str, bytes]:
    """What must be the same bytes: journal and trajectories."""
    files = [directory / JOURNAL, *directory.glob("round*/*.tum")]
    return {str(file.relative_to(directory)): file.read_bytes() for file in files}


def rounds_ended(directory: Path) -> int:
    journal = partial_folder(directory) / JOURNAL
    return journal.read_bytes().count(b"round_ended") if journal.exists() else 0


def kill_while_driving(stage: Stage, spec: RunSpec, out: Path, rounds: int, delay: float) -> None:
    """Drive in a process of its own, which is killed so long after so many rounds have ended."""
    directory = run_folder(out, spec)
    if (pid := os.fork()) == 0:
        run(stage, spec, out)
        os._exit(0)
    while rounds_ended(directory) < rounds and os.waitpid(pid, os.WNOHANG) == (0, 0):
        time.sleep(0.002)
    time.sleep(delay)
    os.kill(pid, signal.SIGKILL)
    assert os.waitpid(pid, 0)[1] == signal.SIGKILL


@pytest.mark.parametrize("method", ["karto", "wheel_odometry"])
def test_a_killed_run_goes_on_and_leaves_the_bytes_of_one_that_was_not(
    method: str, make_stage: Callable[..., Stage], tmp_path: Path
) -> None:
    stage = make_stage(NEAR, rounds=5)
    spec, dice = stage.spec(method, Mode.WITHOUT_MAP), random.Random(method)
    undisturbed, _ = run(stage, spec, tmp_path / "undisturbed")
    out = tmp_path / "killed"
    for rounds in (1, 2, 3, 4):
        kill_while_driving(stage, spec, out, rounds, dice.uniform(0.0, 0.2))
    kept, notices, resumed_at = rounds_ended(run_folder(out, spec)), Notices(), datetime.now(UTC).isoformat()
    directory, complete = run(stage, spec, out, notices)
    assert complete
    assert kept >= 4
    assert f"goes on after {kept} rounds" in notices.heard[0]
    assert recorded(directory) == recorded(undisturbed)
    one, other = load_run(directory).manifest, load_run(undisturbed).manifest
    assert (one.simulated_s, one.complete, one.failure) == (other.simulated_s, other.complete, other.failure)
    assert one.files == other.files
    assert one.compute_s > other.compute_s / 2
    assert one.started_utc < resumed_at
    assert sorted(path.name for path in directory.parent.iterdir()) == ["seed0"]


def test_a_failed_infrastructure_costs_no_round_that_ended(
    make_stage: Callable[..., Stage], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = make_stage(NEAR, rounds=3)
    spec = stage.spec("wheel_odometry", Mode.WITHOUT_MAP)
    undisturbed, _ = run(stage, spec, tmp_path / "undisturbed")
    starts, start = [], MethodHost.start

    def failing(host: MethodHost) -> None:
        starts.append(host)
        if len(starts) in (2, 4):
            raise HostFailedError("no process left")
        start(host)

    monkeypatch.setattr(MethodHost, "start", failing)
    directory, _ = run(stage, spec, tmp_path / "failed")
    assert len(starts) == 5
    assert recorded(directory) == recorded(undisturbed)


def test_a_failed_round_stays_failed(make_stage: Callable[..., Stage], tmp_path: Path) -> None:
    stage = make_stage(NEAR, rounds=3, goal_timeout=1.0)
    spec = stage.spec("wheel_odometry", Mode.WITHOUT_MAP)
    undisturbed, _ = run(stage, spec, tmp_path / "undisturbed")
    kill_while_driving(stage, spec, tmp_path / "out", 2, 0.0)
    directory, complete = run(stage, spec, tmp_path / "out")
    assert not complete
    assert recorded(directory) == recorded(undisturbed)
    assert load_run(directory).manifest.failure == load_run(undisturbed).manifest.failure


def test_with_map_a_run_begins_anew_and_says_so(make_stage: Callable[..., Stage], tmp_path: Path) -> None:
    stage = make_stage(NEAR, rounds=2)
    spec = stage.spec("wheel_odometry", Mode.WITH_MAP)
    undisturbed, _ = run(stage, spec, tmp_path / "undisturbed")
    kill_while_driving(stage, spec, tmp_path / "out", 1, 0.0)
    notices = Notices()
    directory, _ = run(stage, spec, tmp_path / "out", notices)
    assert "begins anew: its rounds are one lifetime of the method" in notices.heard[0]
    assert recorded(directory) == recorded(undisturbed)


def test_what_another_configuration_left_is_removed_and_that_is_said(
    make_stage: Callable[..., Stage], tmp_path: Path
) -> None:
    stage, other = make_stage(NEAR, rounds=2), make_stage(NEAR, rounds=2, pause=0.7)
    kill_while_driving(other, other.spec("wheel_odometry", Mode.WITHOUT_MAP), tmp_path, 1, 0.0)
    notices = Notices()
    spec = stage.spec("wheel_odometry", Mode.WITHOUT_MAP)
    directory, complete = run(stage, spec, tmp_path, notices)
    assert complete
    assert "of another configuration or version" in notices.heard[0]
    assert len(load_run(directory).rounds()) == 2
