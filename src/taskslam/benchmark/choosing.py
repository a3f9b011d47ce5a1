"""Driving for a choice: each seed on an engine, scored, as long as the budget lasts (`evaluation/choice.py`)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from taskslam.benchmark.engine import DRIVEN, Ending, Engine, Result, Watcher
from taskslam.benchmark.spec import RunSpec, run_folder
from taskslam.benchmark.stage import Stage
from taskslam.errors import RecordError
from taskslam.evaluation import RunMetrics, run_metrics
from taskslam.evaluation.choice import Score, score_of
from taskslam.mode import Mode
from taskslam.record import load_run
from taskslam.slam.guest.latency import LatencyModel


@dataclass(frozen=True)
class Tolerance:
    """Of the follow-up task: metres and radians about the mean pose."""

    position_m: float
    heading_rad: float = math.inf


@dataclass
class Driver:
    """Drives methods in a seed at all places. budget_s: core seconds for all of it; out: where runs stand.

    spent_s: core seconds of the runs so far, finished before or not; refused: what could not be driven, and why;
    exhausted: whether the budget does not reach for another seed. metrics: of the runs of each method.
    """

    stages: Sequence[Stage]
    mode: Mode
    latency: LatencyModel
    tolerance: Tolerance
    engine: Engine
    watcher: Watcher
    out: Path
    budget_s: float = math.inf
    spent_s: float = 0.0
    refused: list[Result] = field(default_factory=list)
    exhausted: bool = False
    metrics: dict[str, list[RunMetrics]] = field(default_factory=dict)

    def drive(self, methods: Sequence[str], seed: int) -> Mapping[str, Score]:
        """The scores of a seed; none if the budget does not reach for what the last seed of these methods took."""
        if self.spent_s + math.fsum(self.price_s(method) for method in methods) > self.budget_s:
            self.exhausted = True
            return {}
        specs = [stage.spec(method, self.mode, seed, None, self.latency) for stage in self.stages for method in methods]
        driven: dict[str, list[RunMetrics]] = {}
        for result in self.engine.run(specs, self.out, self.watcher):
            found = self._metrics(result)
            if found is not None:
                driven.setdefault(found.method, []).append(found)
        for method, runs in driven.items():
            self.metrics.setdefault(method, []).extend(runs)
            self.spent_s += math.fsum(run.wall_s for run in runs)
        whole = {method: runs for method, runs in driven.items() if len(runs) == len(self.stages)}
        return {
            method: score_of(runs, self.tolerance.position_m, self.tolerance.heading_rad)
            for method, runs in whole.items()
        }

    def price_s(self, method: str) -> float:
        """Core seconds of a method's last seed; 0 before the first."""
        return math.fsum(run.wall_s for run in self.metrics.get(method, [])[-len(self.stages) :])

    def _metrics(self, result: Result) -> RunMetrics | None:
        spec = result.spec
        if result.ending not in DRIVEN or spec is None:
            self.refused.append(result)
            return None
        try:
            return _measured(spec, self.out)
        except RecordError as error:
            self.refused.append(Result(result.title, Ending.REFUSED, str(error), spec))
            return None


def _measured(spec: RunSpec, out: Path) -> RunMetrics:
    folder = run_folder(out, spec)
    return run_metrics(load_run(folder), str(folder.relative_to(out)))
