"""From a campaign to the runs that it means, as specs that any engine can drive.

campaign = load_campaign("paper")
planned = plan(campaign, sets=("builtin",))
results = list(LocalEngine(cores=2, folders=planned.folders).run(planned.specs, out, Watcher()))
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from taskslam.benchmark.campaign.campaign_file import Campaign, MethodChoice, Selection, SingleRun
from taskslam.benchmark.engine import Ending, Result
from taskslam.benchmark.spec import RunSpec, spec_of_tour
from taskslam.benchmark.stage import folders_of, set_stage
from taskslam.errors import InputError
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.scenario import load_scenario
from taskslam.slam.guest.latency import LatencyModel
from taskslam.slam.registry import find_method

SpecOf = Callable[..., RunSpec]


@dataclass(frozen=True)
class Plan:
    """The runs of a campaign. refused: scenarios that cannot be driven here, and why; folders: where files lie."""

    specs: tuple[RunSpec, ...]
    refused: tuple[Result, ...] = ()
    folders: tuple[Path, ...] = ()


@dataclass(frozen=True)
class _Cell:
    """One run, in the words of the file."""

    scenario: str
    method: MethodChoice
    mode: Mode
    seed: int
    latency: str
    robot: str | None


def plan(
    campaign: Campaign, sets: Sequence[str] = (), world_paths: Sequence[Path] = (), observer: Observer | None = None
) -> Plan:
    """The runs of a campaign, methods innermost so that a comparison grows evenly, and no run twice.

    sets: of the scenarios, those that are meant; empty for all, and only then single runs are planned. Each scenario's
    world is loaded once for every robot, since a run is known by what is in it.

    Raises:
        InputError: no such set, no run at all, a latency that is none. UnknownMethodError: no such method.
    """
    matrix = list(_matrix(campaign, campaign.scenarios_of(tuple(sets))))
    cells = [cell for cell in matrix if not any(_is_meant(exclusion, cell) for exclusion in campaign.exclude)]
    cells += [] if sets else [_single(run) for run in campaign.runs]
    if not cells:
        raise InputError(
            f"campaign {campaign.name}: no run is left to drive; expected scenarios and methods, or runs, that no"
            " exclusion leaves out"
        )
    for method in dict.fromkeys(cell.method.name for cell in cells):
        find_method(method)
    delays = {words: LatencyModel.of(words) for words in dict.fromkeys(cell.latency for cell in cells)}
    tours, refused, folders = _tours(campaign, cells, world_paths, observer or Observer())
    specs = {
        spec.digest: spec
        for cell in cells
        if (spec_of := tours.get((cell.scenario, cell.robot))) is not None
        for spec in [
            spec_of(cell.method.name, cell.mode, cell.seed, cell.method.options, delays[cell.latency], campaign.sealed)
        ]
    }
    return Plan(tuple(specs.values()), tuple(refused), tuple(dict.fromkeys(folders)))


def _tours(
    campaign: Campaign, cells: Sequence[_Cell], world_paths: Sequence[Path], observer: Observer
) -> tuple[dict[tuple[str, str | None], SpecOf], list[Result], list[Path]]:
    """What makes a spec of each scenario with each robot, what is refused, and the folders with their files."""
    tours: dict[tuple[str, str | None], SpecOf] = {}
    refused, folders = [], [*world_paths]
    for name, robot in dict.fromkeys((cell.scenario, cell.robot) for cell in cells):
        overrides = [f"protocol.rounds={campaign.rounds}", *campaign.settings]
        overrides += [] if robot is None else [f"robot={robot}"]
        try:
            scenario = load_scenario(name, overrides)
            stage = set_stage(scenario, world_paths, observer)
        except InputError as error:
            title = name if robot is None else f"{name} · {robot}"
            refused.append(Result(title, Ending.REFUSED, str(error)))
        else:
            folders += folders_of(scenario)
            tours[name, robot] = partial(spec_of_tour, scenario, stage.robot, stage.digests)
    return tours, refused, folders


def _matrix(campaign: Campaign, scenarios: Sequence[str]) -> Iterator[_Cell]:
    for seed in campaign.seeds:
        for scenario in scenarios:
            for robot in campaign.robots or (None,):
                for mode in campaign.modes:
                    for latency in campaign.latencies:
                        for method in campaign.choices:
                            yield _Cell(scenario, method, mode, seed, latency, robot)


def _single(run: SingleRun) -> _Cell:
    method = MethodChoice(name=run.method, options=run.options)
    return _Cell(run.scenario, method, run.mode, run.seed, run.latency, run.robot)


def _is_meant(selection: Selection, cell: _Cell) -> bool:
    values = _values(cell)
    return all(values[key] in allowed for key, allowed in selection.said.items()) and (
        selection.options is None or selection.options == cell.method.options
    )


def _values(cell: _Cell) -> dict[str, object]:
    return {
        "scenario": cell.scenario,
        "method": cell.method.name,
        "mode": cell.mode,
        "seed": cell.seed,
        "latency": cell.latency,
        "robot": cell.robot,
    }
