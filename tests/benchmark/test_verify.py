"""Runs that are driven again from their records."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from taskslam.benchmark import verify as module
from taskslam.benchmark.run import run
from taskslam.benchmark.stage import Stage
from taskslam.benchmark.verify import Agreement, verify
from taskslam.errors import RecordError
from taskslam.geometry import SE2
from taskslam.mode import Mode
from taskslam.record import Arrival, RunRecord, load_run

NEAR = [[-1.5, -1.0, 0.0]]


@pytest.fixture
def stage(make_stage: Callable[..., Stage], monkeypatch: pytest.MonkeyPatch) -> Stage:
    """A short tour, on which specs are driven again: its world is none that has a name."""
    stage = make_stage(NEAR, rounds=3, pause=0.1, still_start=0.1)
    monkeypatch.setattr(module, "stage_of", lambda spec, folders, observer: stage)
    return stage


def drive(stage: Stage, out: Path, seed: int = 0) -> tuple[Path, RunRecord]:
    directory, complete = run(stage, stage.spec("wheel_odometry", Mode.WITHOUT_MAP, seed), out)
    assert complete
    return directory, load_run(directory)


def test_a_deterministic_run_is_verified_by_its_bytes_and_versions_that_changed_are_named(
    stage: Stage, tmp_path: Path
) -> None:
    directory, _ = drive(stage, tmp_path / "out")
    manifest = json.loads((directory / "run.json").read_text())
    manifest["versions"]["numpy"] = "1.0"
    (directory / "run.json").write_text(json.dumps(manifest))
    verdict = verify(directory)
    assert verdict.agreement is Agreement.SAME_BYTES
    (change,) = verdict.changes
    assert change.startswith("numpy 1.0 became ")
    spec = json.loads((directory / "spec.json").read_text())
    (directory / "spec.json").write_text(json.dumps(spec | {"seed": 5}))
    with pytest.raises(RecordError, match=r"spec.json is not the spec of run.json"):
        verify(directory)
    (directory / "spec.json").write_text(json.dumps(spec | {"behaviour": 1}))
    verdict = verify(directory)
    assert verdict.agreement is Agreement.NOT_JUDGED
    assert "behaviour version 1 drove it" in verdict.sentence
    journal = directory / "journal.jsonl"
    journal.write_text(journal.read_text() + " ")
    verdict = verify(directory)
    assert verdict.agreement is Agreement.DIFFERENT
    assert "journal.jsonl: has changed since the run was finished" in verdict.sentence


def test_without_the_same_bytes_the_numbers_decide(stage: Stage, tmp_path: Path) -> None:
    """Two seeds stand for two runs of a method that does not repeat itself."""
    (_, one), (_, other) = (drive(stage, tmp_path / "out", seed) for seed in (0, 1))
    spec = stage.spec("wheel_odometry", Mode.WITHOUT_MAP)
    told = module._compared(one, other, spec)
    assert told.agreement is Agreement.DIFFERENT
    assert "journal.jsonl differs from line 4 on, though the method is deterministic" in told.sentence
    card = other.manifest.method_card | {"deterministic": False}
    free = RunRecord(other.directory, other.manifest.model_copy(update={"method_card": card}), other.events)
    assert module._compared(one, free, spec).agreement is Agreement.SAME_RESULT
    worse = [
        replace(event, truth=event.truth @ SE2(1.0 + 0.5 * event.round, 0.0, 0.0))
        if isinstance(event, Arrival)
        else event
        for event in other.events
    ]
    elsewhere = module._compared(one, RunRecord(other.directory, free.manifest, tuple(worse)), spec)
    assert elsewhere.agreement is Agreement.DIFFERENT
    assert "more than the intervals allow" in elsewhere.sentence
