"""What `import taskslam` gives: the benchmark as a handful of functions on values.

    spec = taskslam.tour("house", "karto", mode="without-map", rounds=2)
    run = taskslam.run(spec, out="results")
    results = taskslam.load("results")
    results.metrics.to_pandas()

The command line does the same with the same words. docs/python.md shows each function at work.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from taskslam.benchmark.run import run as _drive
from taskslam.benchmark.sealing import sealed as _sealed
from taskslam.benchmark.spec import RunSpec
from taskslam.benchmark.stage import set_stage, stage_of
from taskslam.errors import InputError, did_you_mean
from taskslam.evaluation.evaluate import evaluate_runs, load_metrics
from taskslam.evaluation.gate import DEFAULT_RULES, GateReport, judge, parse_rules
from taskslam.evaluation.metrics_file import LeftOut, MetricsFile, RunMetrics
from taskslam.evaluation.metrics_file import write_metrics as _write_metrics
from taskslam.evaluation.quantities import quantities
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.scenario import load_scenario
from taskslam.slam.guest.latency import LatencyModel
from taskslam.studies.study import load_study
from taskslam.studies.study_evaluation import evaluate_study
from taskslam.studies.study_results import OpenLoopResults
from taskslam.studies.study_settings import Settings
from taskslam.table import Table
from taskslam.user_files import check

__all__ = ["Results", "RunSpec", "Table", "compare", "evaluate", "load", "run", "tour", "trajectories"]

Folder = str | Path


def tour(
    scenario: Folder,
    method: str,
    mode: str = Mode.WITHOUT_MAP,
    seed: int = 0,
    rounds: int | None = None,
    options: Mapping[str, Any] | None = None,
    latency: str = "fixed",
    settings: Mapping[str, Any] | None = None,
    world_paths: Sequence[Folder] = (),
    sealed: bool = False,
) -> RunSpec:
    """The spec of a tour: what `run` drives.

    scenario: a shipped name or a YAML file; mode: `without-map` or `with-map`; rounds: those that count, by default the
    scenario's; options: the method's own; latency: `fixed`, `zero`, `measured` or `measured x 4`; settings: scenario
    keys, `{"protocol.pause": 2}`; world_paths: where your copies of Gazebo worlds lie; sealed:
    noise that the method cannot guess.

    Raises InputError (one sentence: what, where, what was expected) before anything is driven.
    """
    overrides = [f"{key}={json.dumps(value)}" for key, value in (settings or {}).items()]
    if rounds is not None:
        overrides.append(f"protocol.rounds={rounds}")
    delay = LatencyModel.of(latency)
    stage = set_stage(load_scenario(scenario, overrides), [Path(path) for path in world_paths], Observer())
    return stage.spec(method, _mode(mode), seed, options, delay, sealed)


def run(
    spec: RunSpec,
    out: Folder = "results",
    world_paths: Sequence[Folder] = (),
    overwrite: bool = False,
    observer: Observer | None = None,
) -> Results:
    """Drive a run, in this process, and load it. A finished run of the same spec under `out` is kept.

    Raises InputError, RecordError (another run stands there), InfrastructureError; a method that fails is a result.
    """
    observer = observer or Observer()
    stage = stage_of(spec, [Path(path) for path in world_paths], observer)
    with _sealed(Path(out), spec.sealed):
        directory, _ = _drive(stage, spec, Path(out), observer, overwrite)
    return load(directory)


def load(*folders: Folder) -> Results:
    """Everything that was run in these folders, at any depth, evaluated.

    Raises RecordError if there is nothing; a run that cannot be read is named in `left_out`.
    """
    return Results(evaluate_runs([Path(folder) for folder in folders]))


def evaluate(folder: Folder) -> MetricsFile:
    """Evaluate a folder of runs and write metrics.json into it, as `taskslam evaluate` does. Raises RecordError."""
    metrics = evaluate_runs([Path(folder)])
    _write_metrics(Path(folder), metrics)
    return metrics


def compare(base: Folder, new: Folder, fail_on: str = DEFAULT_RULES) -> GateReport:
    """Did results get worse? Folders of runs, or metrics.json files; the report says `passed` and every finding.

    fail_on: rules as `taskslam compare --fail-on` takes them. Raises InputError, RecordError.
    """
    rules = parse_rules(fail_on)
    old, fresh = load_metrics(Path(base)), load_metrics(Path(new))
    return judge(old.runs, fresh.runs, rules, fresh.left_out)


def trajectories(
    groundtruth: Folder, runs: Sequence[Folder] = (), out: Folder | None = None, times: Folder | None = None,
    **options: Any,
) -> OpenLoopResults:  # fmt: skip
    """Recorded runs against the ground truth and against one another: what `taskslam evaluate-trajectories` computes.

    groundtruth, runs: files, or a folder or study file alone; out: a folder for all that the command line writes, or
    None for nothing; times: for KITTI files; options: as those of the command line, `align="yaw", rpe=["1m", "5s"]`.
    Raises TrajectoryError, InputError.
    """
    study = load_study(str(groundtruth), [str(run) for run in runs], None if times is None else str(times))
    settings = check(Settings, {**study.settings.written(), **options}, "trajectories", InputError)
    if out is None:
        return evaluate_study(study, settings)
    from taskslam.report.trajectories import evaluate_into  # loads matplotlib

    return evaluate_into(Path(out), study, settings)[0]


@dataclass(frozen=True)
class Results:
    """Evaluated runs: as tables of plain arrays, and behind them every number of metrics.json (`file`)."""

    file: MetricsFile

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        """Folders that could not be evaluated, and why."""
        return self.file.left_out

    @cached_property
    def runs(self) -> Table:
        """One row a run: what was run, how it ended, what it took."""
        names = (
            "directory", "scenario", "method", "mode", "seed", "rounds", "options", "latency", "planner", "robot",
            "complete_waypoints", "planned_waypoints", "failures", "frames", "dropped_frames", "simulated_s", "wall_s",
            "compute_s", "method_peak_bytes",
        )  # fmt: skip
        return Table.of_rows(
            names,
            (
                (
                    run.directory, run.scenario, run.method, run.mode, run.seed, run.rounds,
                    json.dumps(run.method_options, sort_keys=True), run.latency, run.planner, run.robot,
                    run.complete_waypoints, run.planned_waypoints, len(run.failures), run.frames, run.dropped_frames,
                    run.simulated_s, run.wall_s, run.compute_s, run.method_peak_bytes,
                )
                for run in self.file.runs
            ),
        )  # fmt: skip

    @cached_property
    def metrics(self) -> Table:
        """One row a run: every quantity in SI units and the ends of its 95 % interval; NaN where it is not defined."""
        names = [name for one in quantities() for name in (one.key, f"{one.key}_low", f"{one.key}_high")]
        return Table.of_rows((*_KEY, *names), (_measured(run) for run in self.file.runs))

    @cached_property
    def arrivals(self) -> Table:
        """One row an arrival in a round that counts: metres and radians in `map`, NaN where a pose is not known.

        waypoint counts from 1, as on figures; round as in the journal, where a priming round is round 0.
        """
        names = (*_KEY, "waypoint", "round", "t_s", *(f"{whose}_{what}" for whose in _POSES for what in _POSE))
        return Table.of_rows(names, (row for run in self.file.runs for row in _arrivals(run)))


_KEY = ("scenario", "method", "mode", "seed")
_POSES, _POSE = ("target", "truth", "estimate", "odometry"), ("x", "y", "theta")


def _measured(run: RunMetrics) -> tuple[object, ...]:
    found = [run.quantities[one.key] for one in quantities()]
    numbers = [_number(number) for of in found for number in (of.value, of.low, of.high)]
    return (run.scenario, run.method, run.mode, run.seed, *numbers)


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _arrivals(run: RunMetrics) -> Iterator[tuple[object, ...]]:
    unknown = (None, None, None)
    for waypoint in run.waypoints:
        for visit in waypoint.arrivals:
            poses = (waypoint.target, visit.truth, visit.estimate, visit.odometry)
            numbers = [number for pose in poses for number in (pose or unknown)]
            yield (run.scenario, run.method, run.mode, run.seed, waypoint.goal + 1, visit.round, visit.t_s, *numbers)


def _mode(word: str) -> Mode:
    if word not in list(Mode):
        raise InputError(f"mode '{word}': expected {' or '.join(Mode)}.{did_you_mean(word, Mode)}")
    return Mode(word)
