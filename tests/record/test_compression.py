"""Compressed trajectories are the same run: read as before, checked as before, and brought back byte for byte."""

from __future__ import annotations

import gzip
import shutil
from pathlib import Path
from typing import Any

import pytest

from taskslam.errors import RecordError
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.reading import read_bytes
from taskslam.record import RoundEnded, RoundStarted, RunWriter, load_run
from taskslam.record.compression import compress_trajectories, expand_trajectories


@pytest.fixture
def run(tmp_path: Path, manifest: dict[str, Any]) -> Path:
    with RunWriter(tmp_path / "run") as writer:
        writer.event(RoundStarted(0, 0, priming=False))
        for step in range(2000):
            writer.pose("truth", 0, step, SE2(step / 7, 1 / (step + 3), 0.1))
            writer.pose("estimate", 0, step, SE2(step / 7.1, 0.0, 0.1))
        writer.event(RoundEnded(2000, 0, Outcome.REACHED, 1, 0))
        return writer.finish(manifest)


def content(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_compressed_run_is_the_same_run_and_comes_back(run: Path) -> None:
    before, poses = content(run), load_run(run).trajectory(0, "truth").poses.tolist()
    freed = compress_trajectories(run)
    assert freed > sum(len(data) for name, data in before.items() if name.endswith(".tum")) / 2
    assert sorted(path.name for path in (run / "round00").iterdir()) == ["estimate.tum.gz", "truth.tum.gz"]
    record = load_run(run, damaged=True)
    assert record.trajectory(0, "truth").poses.tolist() == poses
    assert record.changed == ()
    assert gzip.decompress((run / "round00" / "truth.tum.gz").read_bytes()) == before["round00/truth.tum"]
    assert compress_trajectories(run) == 0
    assert expand_trajectories(run) == -freed
    assert content(run) == before


def test_a_change_of_what_is_compressed_is_named(run: Path) -> None:
    compress_trajectories(run)
    file = run / "round00" / "truth.tum.gz"
    file.write_bytes(gzip.compress(gzip.decompress(file.read_bytes()).replace(b"0.1", b"0.2", 1)))
    (sentence,) = load_run(run, damaged=True).changed
    assert "truth.tum: has changed since the run was finished" in sentence


def test_what_a_kill_left_in_both_forms_is_put_in_order(run: Path) -> None:
    before = content(run)
    compress_trajectories(run)
    (run / "round00" / "truth.tum").write_bytes(before["round00/truth.tum"])
    assert load_run(run, damaged=True).changed == ()
    again = run.with_name("again")
    shutil.copytree(run, again)
    compress_trajectories(again)
    assert not (again / "round00" / "truth.tum").exists()
    expand_trajectories(run)
    assert content(run) == before


@pytest.mark.parametrize(
    "damage", [lambda data: data[:50], lambda data: b"no gzip", lambda data: data[:-40] + bytes(40)]
)
def test_a_damaged_file_ends_in_a_sentence(run: Path, damage: Any) -> None:
    compress_trajectories(run)
    file = run / "round00" / "truth.tum.gz"
    file.write_bytes(damage(file.read_bytes()))
    with pytest.raises(RecordError, match=r"truth\.tum\.gz: cannot read the"):
        load_run(run).trajectory(0, "truth")
    assert load_run(run, damaged=True).changed


def test_no_more_is_unpacked_than_a_file_may_hold(tmp_path: Path) -> None:
    (tmp_path / "bomb.gz").write_bytes(gzip.compress(bytes(50 << 20)))
    with pytest.raises(RecordError, match="holds more than 1 MB"):
        read_bytes(tmp_path / "bomb.gz", "table", RecordError, 1 << 20)
