"""What a spec holds, what its digest feels, and digests that must never change unless behaviour does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from taskslam.benchmark.spec import BEHAVIOUR, RunSpec, run_folder
from taskslam.benchmark.stage import Stage
from taskslam.errors import InputError
from taskslam.mode import Mode
from taskslam.slam.guest.latency import LatencyMode, LatencyModel
from taskslam.world import Material

GOLDEN = "155b42a4afca2b90ff256715fd2c359e18b76069d7801f9b6256665ed91a3183"
GOLDEN_TASK = "0946a862fe20bac97790cc1be8ab9d67d95ae4deac5a4df9526539d2f258b96a"


@pytest.fixture
def stage(make_stage: Callable[..., Stage]) -> Stage:
    return make_stage()


def spec_of(stage: Stage, **how: Any) -> RunSpec:
    return stage.spec(**{"method": "karto", "mode": Mode.WITHOUT_MAP, "seed": 3, **how})


def test_digests_change_only_with_the_behaviour_version(stage: Stage) -> None:
    """Whoever changes what a run leaves behind raises BEHAVIOUR, and writes the new digests here."""
    spec = spec_of(stage, options={"loop_closing": False}, latency=LatencyModel(LatencyMode.MEASURED, 4.0))
    assert (BEHAVIOUR, spec.digest, spec.task_digest) == (4, GOLDEN, GOLDEN_TASK)


def test_a_spec_goes_through_json_and_is_the_same(stage: Stage) -> None:
    spec = spec_of(stage, options={"resolution": 0.1, "names": ["a", "b"]})
    back = RunSpec.from_json(spec.to_json())
    assert back == spec
    assert back.digest == spec.digest
    with pytest.raises(InputError, match=r"run spec: mode: .*without-map"):
        RunSpec.from_json(spec.to_json().replace('"without-map"', '"without"'))


def test_an_option_that_json_cannot_hold_is_refused(stage: Stage) -> None:
    with pytest.raises(InputError, match=r"method 'karto': option value .* expected text, numbers or lists"):
        spec_of(stage, options={"grid": np.zeros(3)})


def changed(stage: Stage, **update: Any) -> Stage:
    return replace(stage, scenario=stage.scenario.model_copy(update=update))


def moved(stage: Stage) -> Stage:
    vertices = stage.world.collision.vertices.copy()
    vertices[0, 0] += 1e-3
    return replace(stage, world=replace(stage.world, collision=replace(stage.world.collision, vertices=vertices)))


def blunter(stage: Stage) -> Stage:
    rig = stage.robot.rig
    lidar = rig.lidar_2d.model_copy(update={"noise": 0.02})
    return replace(stage, robot=stage.robot.model_copy(update={"rig": rig.model_copy(update={"lidar_2d": lidar})}))


@pytest.mark.parametrize(
    "other",
    [
        lambda stage: spec_of(stage, seed=4),
        lambda stage: spec_of(stage, mode=Mode.WITH_MAP),
        lambda stage: spec_of(stage, method="hector"),
        lambda stage: spec_of(stage, options={"loop_closing": False}),
        lambda stage: spec_of(stage, latency=LatencyModel(LatencyMode.ZERO)),
        lambda stage: spec_of(moved(stage)),
        lambda stage: spec_of(blunter(stage)),
        lambda stage: spec_of(replace(stage, plan=replace(stage.plan, resolution=0.051))),
        lambda stage: spec_of(replace(stage, world=replace(stage.world, materials=(Material("plain", (1, 0, 0, 1)),)))),
        lambda stage: spec_of(changed(stage, planner="pure_pursuit")),
        lambda stage: spec_of(stage).model_copy(update={"behaviour": BEHAVIOUR + 1}),
    ],
)
def test_whatever_can_change_a_result_changes_the_digest(stage: Stage, other: Callable[[Stage], RunSpec]) -> None:
    assert other(stage).digest != spec_of(stage).digest


def test_where_files_lie_and_what_they_are_called_changes_nothing(stage: Stage) -> None:
    elsewhere = changed(stage, title="Another title", robot="somewhere/else/mine.yaml")
    assert spec_of(elsewhere).digest == spec_of(stage).digest
    plan = stage.scenario.floor_plan.model_copy(update={"map": "/somewhere/plan.yaml"})
    file = stage.scenario.world.model_copy(update={"name": None, "file": "/somewhere/room.world"})
    spec = spec_of(changed(stage, floor_plan=plan, world=file))
    assert spec.digest == spec_of(stage).digest
    assert "somewhere" not in spec.to_json()
    assert "room.world" in spec.to_json()


def test_a_run_stands_where_its_way_says(stage: Stage) -> None:
    out = Path("out")
    assert run_folder(out, spec_of(stage)) == out / "room" / "karto" / "without-map" / "seed3"
    assert run_folder(out, spec_of(stage, method="my_package:Mine")).parts[2] == "my_package_Mine"
    slow = spec_of(stage, options={"resolution": 0.1}, latency=LatencyModel(LatencyMode.MEASURED, 4.0))
    assert run_folder(out, slow).parts[2] == "karto,resolution=0.1,measured_x_4"
    long = [spec_of(stage, options={"note": "x" * 300 + end}) for end in ("a", "b")]
    assert len({run_folder(out, spec) for spec in long}) == 2
    assert all(len(run_folder(out, spec).parts[2]) < 100 for spec in long)
