"""A comparison that ends once the data carry it. The engine here writes runs of known precision, and drives none."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest

from taskslam.benchmark.campaign.campaign_file import load_campaign
from taskslam.benchmark.campaign.planning import Plan, plan
from taskslam.benchmark.engine import Ending, Result, Watcher
from taskslam.benchmark.engines.until_decided import UntilDecided, check_comparable
from taskslam.benchmark.spec import RunSpec, run_folder
from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.observer import Observer
from taskslam.outcomes import Outcome
from taskslam.record import Arrival, RoundEnded, RoundStarted, RunEnded, RunWriter

SEEDS = 12


class Recorded:
    """An engine whose runs scatter by so much at the one waypoint, m, by the way they are run."""

    def __init__(self, scatter: dict[str, float]) -> None:
        self.scatter = scatter
        self.specs: list[RunSpec] = []

    def run(self, specs: Sequence[RunSpec], out: Path, watcher: Watcher) -> Iterator[Result]:
        for spec in specs:
            self.specs.append(spec)
            write_run(run_folder(out, spec), spec, self.scatter[spec.way])
            watcher.begins(spec)
            yield Result(spec.title, Ending.COMPLETE, "", spec)


def write_run(folder: Path, spec: RunSpec, scatter: float) -> None:
    dice = np.random.default_rng([spec.seed, len(spec.way)])
    goal, t = SE2(1.0, 0.0, 0.0), 0
    with RunWriter(folder) as run:
        for number in range(spec.task.rounds):
            run.event(RoundStarted(t, number, priming=False))
            x, y = dice.normal(0.0, scatter, 2)
            run.event(Arrival(t + 1, number, 0, goal, goal @ SE2(x, y, 0.0), goal, None))
            run.event(RoundEnded(t + 2, number, Outcome.REACHED, 10, 0))
            t += 3
        run.event(RunEnded(t, complete=True))
        run.finish(
            {
                "scenario_name": spec.task.name,
                "scenario": {"sequence": {"waypoints": [{"x": 1.0, "y": 0.0, "theta": 0.0}], "path": None}},
                "scenario_hash": "0" * 64,
                "method": spec.method,
                "method_card": {"name": spec.method},
                "method_options": spec.options,
                "mode": spec.mode,
                "seed": spec.seed,
                "rounds": spec.task.rounds,
                "latency": "fixed",
                "started_utc": "2030-01-01T00:00:00Z",
                "wall_s": 1.0,
                "simulated_s": 1.0,
                "complete": True,
            }
        )


@pytest.fixture
def planned(write_campaign: Callable[..., Path]) -> Plan:
    seeds = f"seeds: {list(range(SEEDS))}"
    return plan(load_campaign(str(write_campaign("methods: [karto, hector]", seeds, rounds=5))), [], [], Observer())


def test_the_better_method_is_told_and_no_further_seed_is_driven(planned: Plan, tmp_path: Path) -> None:
    engine, told = Recorded({"karto": 0.005, "hector": 0.05}), list[str]()
    results = list(UntilDecided(engine, told.append).run(planned.specs, tmp_path / "out", Watcher()))
    (words,) = told
    assert words.startswith("without-map, after seed ")
    assert "karto is the most repeatable" in words
    driven = {spec.seed for spec in engine.specs}
    assert 6 <= len(driven) < SEEDS
    assert driven == set(range(len(driven)))
    assert len(results) == len(planned.specs)
    endings = [result.ending for result in results]
    assert endings.count(Ending.NOT_NEEDED) == 2 * (SEEDS - len(driven))
    assert endings.count(Ending.COMPLETE) == 2 * len(driven)


def test_methods_that_are_alike_are_driven_to_the_end(planned: Plan, tmp_path: Path) -> None:
    engine, told = Recorded({"karto": 0.02, "hector": 0.02}), list[str]()
    results = list(UntilDecided(engine, told.append).run(planned.specs, tmp_path / "out", Watcher()))
    assert told == []
    assert {result.ending for result in results} == {Ending.COMPLETE}


def test_one_method_is_no_comparison(planned: Plan) -> None:
    with pytest.raises(InputError, match="this campaign has 1: expected two or more"):
        check_comparable([spec for spec in planned.specs if spec.method == "karto"])
