"""What the benchmarks share: where the real worlds lie, one core, and a line about the machine."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from embreex.mesh_construction import TriangleMesh as EmbreeMesh
from embreex.rtcore_scene import EmbreeScene

from taskslam.benchmark.run import machine, versions
from taskslam.benchmark.stage import Stage, set_stage
from taskslam.observer import Observer
from taskslam.scenario import load_scenario
from taskslam.world import TriangleMesh

_WORLDS = {
    "aws_small_house": "aws_small_house/worlds/small_house.world",
    "aws_small_warehouse": "aws_small_warehouse/worlds/no_roof_small_warehouse.world",
    "aws_hospital": "aws_hospital/worlds/hospital.world",
}


def aws_world(name: str) -> Path | None:
    """The world file of a scenario under TASKSLAM_DATA, or None where it is absent."""
    data = Path(os.environ.get("TASKSLAM_DATA", Path(__file__).parents[2] / "shared" / "data"))
    path = data / "worlds" / _WORLDS[name]
    return path if path.exists() else None


def small_house(goals: int, rounds: int = 1, robot: str = "turtlebot2") -> tuple[str, Stage]:
    """The first goals of the tour through AWS's small house, or through ours where that is absent; its name first."""
    world = aws_world("aws_small_house")
    name = "aws_small_house" if world else "house"
    overrides = [f"protocol.rounds={rounds}", f"sequence.path={list(range(goals + 1))}", f"robot={robot}"]
    return name, set_stage(load_scenario(name, overrides), [world] if world else [], Observer())


def single_rays(mesh: TriangleMesh) -> EmbreeScene:
    """Raw embreex: `run(origins, directions)` traces one ray after another."""
    scene = EmbreeScene()
    EmbreeMesh(scene, np.ascontiguousarray(mesh.corners(), dtype=np.float32))
    return scene


def pin_to_one_core() -> None:
    """This process and its children share one core from here on."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def machine_line() -> str:
    """Processor and versions, for the head of a table."""
    facts = machine()
    return f"{facts['processor']}, {facts['cores']} cores; " + ", ".join(f"{k} {v}" for k, v in versions().items())
