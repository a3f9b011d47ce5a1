"""Evaluation of result folders: every finished run in them, whatever else lies beside."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from taskslam.errors import RecordError
from taskslam.evaluation.comparison import METRICS, compare_methods
from taskslam.evaluation.metrics_file import LeftOut, MetricsFile, RunMetrics, read_metrics
from taskslam.evaluation.names import method_labels
from taskslam.evaluation.rows import rows_of
from taskslam.evaluation.run_metrics import run_metrics
from taskslam.evaluation.upstream import NONE, Deviations, names_of
from taskslam.printable import printable
from taskslam.reading import is_file, is_folder
from taskslam.record import RunRecord, find_partial_runs, find_runs, load_run


def evaluate_runs(paths: Sequence[Path], deviations: Deviations = NONE) -> MetricsFile:
    """Metrics of all finished runs at or below the given folders, sorted by path, and comparisons of their methods.

    A run that cannot be read, or was left half-written, is named in `left_out` with the reason, and the rest is
    evaluated. Raises RecordError if a folder does not exist or holds no run at all.
    """
    left_out: list[LeftOut] = []
    # Of ten thousand runs, the metrics fit into memory, the events do not: each record is let go at once.
    metrics, rivals = [], []
    for record, found in _each_run(paths, deviations, left_out):
        metrics.append(found)
        if not record.manifest.is_reference:
            rivals.append(found)
    groups = by_method(rivals)
    rows = rows_of(by_method(metrics), deviations)
    return MetricsFile(
        definitions="upstream" if deviations else "paper",
        deviations=names_of(deviations),
        runs=tuple(metrics),
        rows=rows,
        comparisons=tuple(found for metric in METRICS for found in compare_methods(groups, metric)),
        left_out=tuple(left_out),
    )


def load_metrics(path: Path) -> MetricsFile:
    """Metrics from a folder that holds runs, or from a metrics.json. Raises RecordError."""
    return read_metrics(path) if is_file(path) else evaluate_runs([path])


def by_method(runs: Sequence[RunMetrics]) -> dict[str, list[RunMetrics]]:
    """Runs by the labels of their methods; of a tour that was driven twice in the same way, each by its directory."""
    labels = method_labels(runs)
    times = Counter((label, run.mode, run.scenario, run.seed) for label, run in zip(labels, runs, strict=True))
    twice = {key[0] for key, count in times.items() if count > 1}
    groups: dict[str, list[RunMetrics]] = {}
    for label, run in zip(labels, runs, strict=True):
        groups.setdefault(f"{label} ({run.directory})" if label in twice else label, []).append(run)
    return groups


def read_runs(
    paths: Sequence[Path], deviations: Deviations = NONE
) -> tuple[list[tuple[RunRecord, RunMetrics]], tuple[LeftOut, ...]]:
    """Records and metrics of all finished runs, and what was left out; as `evaluate_runs`."""
    left_out: list[LeftOut] = []
    runs = list(_each_run(paths, deviations, left_out))
    return runs, tuple(left_out)


def _each_run(
    paths: Sequence[Path], deviations: Deviations, left_out: list[LeftOut]
) -> Iterator[tuple[RunRecord, RunMetrics]]:
    """Record and metrics of one run after the other; what cannot be evaluated is added to `left_out`."""
    found, partial = _find(paths)
    left_out += [
        LeftOut(directory=printable(name), reason="half-written: stopped, or still under way") for name in partial
    ]
    for name in sorted(found):
        try:
            record = load_run(found[name], damaged=True)
            metrics = run_metrics(record, printable(name), deviations)
        except RecordError as error:
            left_out.append(LeftOut(directory=printable(name), reason=printable(str(error))))
        else:
            yield record, metrics


def _find(paths: Sequence[Path]) -> tuple[dict[str, Path], list[str]]:
    """Finished runs and half-written ones, by their path relative to what was given."""
    if not paths:
        raise RecordError("no folder was given; expected one that holds runs")
    for path in paths:
        if not is_folder(path):
            raise RecordError(f"{path}: no such folder; expected one that holds runs")
    base = os.path.commonpath([path.absolute() for path in paths])
    found: dict[str, Path] = {}
    partial: set[str] = set()
    for path in paths:
        found |= {os.path.relpath(run.absolute(), base): run for run in find_runs(path)}
        partial |= {os.path.relpath(run.absolute(), base) for run in find_partial_runs(path)}
    if not found and not partial:
        names = ", ".join(str(path) for path in paths)
        raise RecordError(f"{names}: holds no run; expected a folder with run.json in it or below")
    return found, sorted(partial)
