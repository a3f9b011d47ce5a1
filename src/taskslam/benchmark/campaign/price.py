"""What a plan costs: simulated hours, and hours of cores.

Where runs of the campaign stand already they are asked: how long the tour took, and how many times faster than real
time the method was driven. For the rest there is a table with its source (`prices.yaml`).
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from itertools import pairwise
from pathlib import Path
from statistics import median

from pydantic import BaseModel, ConfigDict

from taskslam.benchmark.resources import Resources
from taskslam.benchmark.spec import Drive, RunSpec, run_folder
from taskslam.errors import InputError
from taskslam.mode import Mode
from taskslam.record import load_manifest
from taskslam.record.manifest import Manifest
from taskslam.record.run_directory import MANIFEST
from taskslam.slam.cards import card_of
from taskslam.user_files import check, mapping_of

_USUAL = 40.0  # times real time, of a method that is told no more than odometry


class _Table(BaseModel):
    """Of prices.yaml."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    methods: dict[str, float]
    sensors: dict[str, float]
    seconds_per_metre: float
    pixels_per_second: float


@dataclass(frozen=True)
class Price:
    """Of a run. simulated_s: seconds of the tour; core_s: seconds of a core; measured: both rest on runs at hand."""

    simulated_s: float
    core_s: float
    measured: bool


class Prices:
    """Prices of runs, with what the finished ones among them have shown."""

    def __init__(self, specs: Sequence[RunSpec], out: Path, share: Resources | None = None) -> None:
        """Read what is finished under `out`; what cannot be read there is left out."""
        self._share = share or Resources()
        durations: dict[tuple[str, Mode], list[float]] = defaultdict(list)
        factors: dict[tuple[str, str], list[float]] = defaultdict(list)
        for manifest in _finished(specs, out):
            durations[manifest.scenario_name, manifest.mode].append(manifest.simulated_s / _rounds_of(manifest))
            if manifest.wall_s:
                factor = manifest.simulated_s / manifest.wall_s
                factors[manifest.method, manifest.robot_name or ""].append(factor)
        self._durations = {key: median(values) for key, values in durations.items()}
        self._factors = {key: median(values) for key, values in factors.items()}

    def of(self, spec: RunSpec) -> Price:
        """What a run costs."""
        assert isinstance(spec.task, Drive)
        duration = self._durations.get((spec.task.name, spec.mode))
        factor = self._factors.get((spec.method, spec.task.scenario.robot))
        measured = duration is not None and factor is not None
        rounds = spec.task.rounds + (spec.mode is Mode.WITH_MAP)
        simulated_s = rounds * (_round_of(spec.task) if duration is None else duration)
        core_s = simulated_s / (_factor_of(spec) if factor is None else factor) * self._share.of(spec.method).cores
        return Price(simulated_s, core_s, measured)

    def cheapest_first(self, specs: Iterable[RunSpec]) -> list[RunSpec]:
        """In the order of their prices; of equal ones, as they were."""
        return sorted(specs, key=lambda spec: self.of(spec).core_s)


def _finished(specs: Sequence[RunSpec], out: Path) -> Iterable[Manifest]:
    for spec in specs:
        folder = run_folder(out, spec)
        if (folder / MANIFEST).exists():
            try:
                manifest = load_manifest(folder)
            except InputError:
                continue
            if manifest.complete:  # a tour that ended early says little of what a whole one takes
                yield manifest


def _rounds_of(manifest: Manifest) -> int:
    return manifest.rounds + (manifest.mode is Mode.WITH_MAP)


def _round_of(drive: Drive) -> float:
    """Seconds of a round that nobody has driven yet, from the way straight from goal to goal."""
    scenario, protocol = drive.scenario, drive.scenario.protocol
    places = [scenario.start, *scenario.sequence.goals]
    metres = sum(math.hypot(to.x - at.x, to.y - at.y) for at, to in pairwise(places))
    return metres * _table().seconds_per_metre + len(scenario.sequence.goals) * protocol.pause + protocol.still_start


def _factor_of(spec: RunSpec) -> float:
    assert isinstance(spec.task, Drive)
    table = _table()
    sensors = _sensors_of(spec.method)
    known = [table.sensors[name] for name in sensors if name in table.sensors]
    factor = table.methods.get(spec.method, min(known, default=_USUAL))
    stereo = spec.task.robot.rig.stereo
    if stereo is not None and "stereo_images" in sensors:
        pixels = 2 * stereo.width * stereo.height * stereo.rate
        factor *= table.pixels_per_second / pixels
    return min(factor, _USUAL)


@cache
def _sensors_of(method: str) -> tuple[str, ...]:
    try:
        return tuple(str(sensor) for sensor in card_of(method).sensors)
    except InputError:  # it is not installed, which the run will say
        return ()


@cache
def _table() -> _Table:
    text = (resources.files(__package__) / "prices.yaml").read_text(encoding="utf-8")
    return check(_Table, mapping_of(text, "prices.yaml", InputError, "prices"), "prices.yaml", InputError)
