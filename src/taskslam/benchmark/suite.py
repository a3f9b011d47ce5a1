"""A suite: scenarios x methods x modes x seeds x latencies, as specs that any engine can drive.

suite = load_suite("paper")
planned = plan(suite, "builtin")
results = list(LocalEngine(parallel=2).run(planned.specs, out, Watcher()))
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from taskslam.benchmark.engine import Ending, Result
from taskslam.benchmark.spec import RunSpec, spec_of_tour
from taskslam.benchmark.stage import folders_of, set_stage
from taskslam.errors import InputError, did_you_mean
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.scenario import load_scenario
from taskslam.slam.guest.latency import LatencyModel
from taskslam.slam.registry import find_method
from taskslam.user_files import Shipped


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class MethodChoice(_Part):
    """A method in one of its ways."""

    name: str
    options: dict[str, Any] = {}


class Suite(_Part):
    """A named set of runs.

    worlds: scenario names by set; methods: names, or names with options; rounds: those that count; latencies: how
    estimates are delayed, `fixed`, `zero` or `measured x 4`: with several, every run is driven with each.
    """

    name: str
    worlds: dict[str, tuple[str, ...]]
    methods: tuple[str | MethodChoice, ...]
    rounds: int = 5
    latencies: tuple[str, ...] = ("fixed",)


@dataclass(frozen=True)
class Plan:
    """The runs of a suite. refused: scenarios that cannot be driven here, and why; folders: where their files lie."""

    specs: tuple[RunSpec, ...]
    refused: tuple[Result, ...]
    folders: tuple[Path, ...]


def load_suite(reference: str) -> Suite:
    """A suite by shipped name or YAML file.

    Raises:
        InputError: unknown name, unreadable file, unknown key.
    """
    return Shipped("suite", "taskslam.benchmark", "suites", InputError).load(reference, Suite)


def plan(
    suite: Suite,
    worlds: str,
    methods: Sequence[str] = (),
    modes: Iterable[Mode] = tuple(Mode),
    seeds: Sequence[int] = (0,),
    rounds: int | None = None,
    settings: Sequence[str] = (),
    latencies: Sequence[str] = (),
    sealed: bool = False,
    world_paths: Sequence[Path] = (),
    observer: Observer | None = None,
) -> Plan:
    """The runs of a suite, methods innermost so that a comparison grows evenly. settings: scenario keys, `a.b=c`.

    methods, latencies: instead of the suite's. Each scenario's world is loaded once, since a run is known by what is
    in it.

    Raises:
        InputError: the suite has no such set of worlds, or a latency is none. UnknownMethodError: no such method.
    """
    if worlds not in suite.worlds:
        known = ", ".join(suite.worlds)
        hint = did_you_mean(worlds, suite.worlds)
        raise InputError(f"suite {suite.name} has no worlds '{worlds}'; expected one of {known}.{hint}")
    chosen = [MethodChoice(name=one) if isinstance(one, str) else one for one in (tuple(methods) or suite.methods)]
    for method in chosen:
        find_method(method.name)
    delays = [LatencyModel.of(words) for words in (tuple(latencies) or suite.latencies)]
    overrides = (f"protocol.rounds={rounds or suite.rounds}", *settings)
    tours, refused, folders = [], [], [*world_paths]
    for name in suite.worlds[worlds]:
        try:
            scenario = load_scenario(name, overrides)
            stage = set_stage(scenario, world_paths, observer or Observer())
        except InputError as error:
            refused.append(Result(name, Ending.REFUSED, str(error)))
        else:
            folders += folders_of(scenario)
            tours.append(partial(spec_of_tour, scenario, stage.robot, stage.digests))
    specs = [
        spec(method.name, mode, seed, method.options, delay, sealed)
        for seed in seeds
        for spec in tours
        for mode in modes
        for delay in delays
        for method in chosen
    ]
    return Plan(tuple(specs), tuple(refused), tuple(dict.fromkeys(folders)))
