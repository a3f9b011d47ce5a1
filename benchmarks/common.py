"""What the benchmarks share: where the real worlds lie, one core, and a line about the machine."""

from __future__ import annotations

import os
from pathlib import Path

from taskslam.benchmark.run import machine, versions

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


def pin_to_one_core() -> None:
    """This process and its children share one core from here on."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def machine_line() -> str:
    """Processor and versions, for the head of a table."""
    facts = machine()
    return f"{facts['processor']}, {facts['cores']} cores; " + ", ".join(f"{k} {v}" for k, v in versions().items())
