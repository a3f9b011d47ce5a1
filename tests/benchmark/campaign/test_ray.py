"""Ray itself (`make clusters`), two machines' worth of it on this one: one is killed, and nothing is lost."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from benchmark.campaign.conftest import recorded
from ray_cluster import add_machine, lose_machine, ray_cluster
from taskslam.benchmark.campaign.campaign_file import load_campaign
from taskslam.benchmark.campaign.planning import plan
from taskslam.benchmark.engine import Ending, Watcher
from taskslam.benchmark.engines.local import LocalEngine
from taskslam.benchmark.engines.luggage import pack, unpack
from taskslam.benchmark.engines.ray import RayEngine
from taskslam.benchmark.spec import run_folder
from taskslam.benchmark.stage import stage_of
from taskslam.errors import InputError
from taskslam.observer import Observer

MARK = "taskslam-ray-*"


@pytest.fixture
def cluster() -> Iterator[Any]:
    if os.environ.get("TASKSLAM_CLUSTERS") != "1":
        pytest.skip("takes a minute, and an installed ray: make clusters")
    with ray_cluster() as started:
        yield started


def test_a_machine_that_is_lost_costs_no_run(
    cluster: Any, write_campaign: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", None)
    planned = plan(load_campaign(str(write_campaign("seeds: [0, 1]", rounds=3))))
    doomed, _ = (add_machine(cluster) for _ in range(2))
    scratch = Path(tempfile.gettempdir())

    def kill_when_both_drive() -> None:
        deadline = time.monotonic() + 120
        while len(list(scratch.glob(f"{MARK}/**/journal.jsonl"))) < 2 and time.monotonic() < deadline:
            time.sleep(0.05)
        lose_machine(cluster, doomed)

    killer = Thread(target=kill_when_both_drive)
    killer.start()
    out = tmp_path / "out"
    engine = RayEngine(cluster.address, None, planned.folders)
    results = list(engine.run(planned.specs, out, Watcher()))
    killer.join()
    assert [result.ending for result in results] == [Ending.COMPLETE] * 2, results
    list(LocalEngine(1, planned.folders).run(planned.specs, tmp_path / "here", Watcher()))
    for spec in planned.specs:
        assert recorded(run_folder(out, spec)) == recorded(run_folder(tmp_path / "here", spec))
    assert not list(out.rglob(".*"))
    assert not list(scratch.glob(MARK))
    assert [result.ending for result in engine.run(planned.specs, out, Watcher())] == [Ending.KEPT] * 2


def test_a_parcel_holds_what_a_tour_needs(
    write_campaign: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    planned = plan(load_campaign(str(write_campaign("seeds: [0]"))))
    (spec,) = planned.specs
    parcel = pack(spec, planned.folders)
    assert parcel is not None
    assert sorted(parcel.files) == ["room.world"]
    with pytest.raises(InputError, match="lies in none of the folders"):
        pack(spec, [])
    monkeypatch.setenv("TASKSLAM_CACHE", str(tmp_path / "elsewhere"))
    (tmp_path / "room.world").unlink()
    folders = unpack(parcel)
    assert unpack(parcel) == folders
    assert stage_of(spec, folders, Observer()).digests == (spec.task.world, spec.task.floor_plan)  # type: ignore[union-attr]
