"""Slurm itself, on this machine: preempted, requeued and cut off, a campaign leaves what an undisturbed one leaves."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from benchmark.campaign.conftest import recorded, taskslam
from slurm_cluster import Cluster, missing, slurm, wait_for
from taskslam.benchmark.campaign.plan_file import read_plan
from taskslam.benchmark.engine import Ending, Watcher
from taskslam.benchmark.engines.local import LocalEngine
from taskslam.benchmark.engines.slurm import SlurmEngine
from taskslam.benchmark.spec import RunSpec, run_folder
from taskslam.record import load_run
from taskslam.record.place import partial_folder

ROUNDS = 4


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    """In CI Slurm must be there; elsewhere the test skips and says how to get it."""
    if words := missing():
        assert os.environ.get("CI") != "true", words
        pytest.skip(words)
    (tmp_path / "slurm").mkdir()
    with slurm(tmp_path / "slurm") as started:
        yield started


def rounds_ended(out: Path, spec: RunSpec) -> int:
    journal = partial_folder(run_folder(out, spec)) / "journal.jsonl"
    return journal.read_bytes().count(b"round_ended") if journal.exists() else 0


def test_requeued_and_cut_off_a_campaign_leaves_the_bytes_of_one_that_was_not(
    cluster: Cluster, write_campaign: Callable[..., Path], tmp_path: Path
) -> None:
    file, out = write_campaign("seeds: [0, 1]", rounds=ROUNDS), tmp_path / "out"
    submitted = taskslam("campaign", "run", file, "--engine", "slurm", "--out", out, environment=cluster.environment)
    assert submitted.returncode == 0, submitted.stderr
    assert "2 runs are submitted" in submitted.stdout
    planned = read_plan(out).plan
    first, second = specs = planned.specs
    (job,) = (out / "campaign" / "slurm").glob("*/job")
    wait_for(lambda: rounds_ended(out, first) > 0)
    cluster.ask("scontrol", "requeue", f"{job.read_text().strip()}_0")
    wait_for(lambda: rounds_ended(out, second) > 0)
    cluster.kill_node()  # the tasks go on without their slurmd, and Slurm starts them again
    cluster.take_for_dead()
    cluster.take_back()
    again = taskslam("campaign", "resume", out, "--engine", "slurm", environment=cluster.environment)
    assert "2 runs are submitted" in again.stdout, again.stderr
    assert len(list((out / "campaign" / "slurm").glob("*/job"))) == 1  # they are in the queue: none is submitted twice
    wait_for(lambda: not cluster.queue())
    logs = "\n".join(path.read_text() for path in (out / "campaign" / "slurm").glob("*/task-*.txt"))
    collected = taskslam("campaign", "collect", out)
    assert collected.returncode == 0, collected.stdout + logs + cluster.logs()
    assert "2 of 2 runs are finished" in collected.stdout
    undisturbed = tmp_path / "undisturbed"
    assert {result.ending for result in LocalEngine(2, planned.folders).run(specs, undisturbed, Watcher())} == {
        Ending.COMPLETE
    }
    for spec in specs:
        assert recorded(run_folder(out, spec)) == recorded(run_folder(undisturbed, spec))
        assert [path.name for path in run_folder(out, spec).parent.glob(".*")] == []
        assert not load_run(run_folder(out, spec), damaged=True).changed
    assert not list((out / "campaign" / "notes").glob("*"))
    kept = list(SlurmEngine().run(specs, out, Watcher()))
    assert {result.ending for result in kept} == {Ending.KEPT}
