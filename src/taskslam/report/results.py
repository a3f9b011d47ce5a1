"""The results of some folders, ready for figures and tables: who is pooled, in which order, in which colours.

A method is named and pooled as on the page: all its runs in one mode over all sequences, with the sequences that
others drove and it did not kept in its denominators (docs/metrics.md).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from taskslam.evaluation import read_runs
from taskslam.evaluation.metrics_file import LeftOut, RunMetrics
from taskslam.evaluation.pooled import Pooled, missing_sequences, pool
from taskslam.record import RunRecord
from taskslam.report import cards
from taskslam.report.markers import Style, method_styles
from taskslam.report.names import method_labels

MODES = ("without-map", "with-map")


@dataclass(frozen=True)
class Run:
    """One run with the name and style of its method."""

    label: str
    style: Style
    record: RunRecord
    metrics: RunMetrics


@dataclass(frozen=True)
class MethodResult:
    """One method in one mode, pooled. missing: planned waypoints of each sequence that it has no run of."""

    label: str
    mode: str
    style: Style
    runs: tuple[Run, ...]
    missing: tuple[int, ...]
    pooled: Pooled

    @property
    def complete(self) -> bool:
        """Whether every waypoint of every sequence was reached in every round."""
        return self.pooled.complete_waypoints == self.pooled.planned_waypoints

    @property
    def sensor(self) -> str:
        """The sensor that it sees with, as cards name it."""
        return cards.main_sensor(self.runs[0].record.manifest.method_card)

    @property
    def is_reference(self) -> bool:
        """Whether it is told the truth."""
        return self.runs[0].record.manifest.is_reference

    @property
    def rank(self) -> tuple[bool, float, float, str]:
        """Sorts by completeness, then by E; references last."""
        E = self.pooled.position.precision_m
        return (self.is_reference, -self.pooled.completeness, math.inf if E is None else E, self.label)


@dataclass(frozen=True)
class Results:
    """All runs and their pooled results. diameter_m (D), field_of_view (degrees): None where scenarios differ."""

    runs: tuple[Run, ...]
    pooled: tuple[MethodResult, ...]
    left_out: tuple[LeftOut, ...]
    diameter_m: float | None
    field_of_view: float | None

    @property
    def modes(self) -> tuple[str, ...]:
        """The modes that any method ran in, without map first."""
        return tuple(mode for mode in MODES if any(result.mode == mode for result in self.pooled))

    @property
    def rounds(self) -> tuple[int, ...]:
        """Every number M of rounds that a run planned, sorted."""
        return tuple(sorted({run.metrics.rounds for run in self.runs}))

    @property
    def scenarios(self) -> tuple[str, ...]:
        """Names of the scenarios, sorted."""
        return tuple(sorted({run.metrics.scenario for run in self.runs}))

    def in_mode(self, mode: str) -> list[MethodResult]:
        """Methods in one mode: the most complete first, then the most precise; references last."""
        return sorted((result for result in self.pooled if result.mode == mode), key=lambda result: result.rank)

    def methods(self) -> list[tuple[MethodResult | None, ...]]:
        """Each method's results in `MODES`: the most complete over its modes first, then the most precise."""
        by_label = {label: tuple(self._result(label, mode) for mode in MODES) for label in self._labels()}
        return sorted(by_label.values(), key=_overall_rank)

    def _labels(self) -> list[str]:
        return list(dict.fromkeys(result.label for result in self.pooled))

    def _result(self, label: str, mode: str) -> MethodResult | None:
        return next((result for result in self.pooled if (result.label, result.mode) == (label, mode)), None)


def read_results(folders: Sequence[Path]) -> Results:
    """The finished runs at or below some folders. Raises RecordError if there is none that can be read or pooled."""
    read, left_out = read_runs(folders)
    labels = method_labels([record.manifest for record, _ in read])
    sensors = {
        label: cards.main_sensor(record.manifest.method_card) for label, (record, _) in zip(labels, read, strict=True)
    }
    styles = method_styles(labels, sensors)
    runs = [Run(label, styles[label], record, metrics) for label, (record, metrics) in zip(labels, read, strict=True)]
    diameters = {run.record.manifest.robot_diameter for run in runs}
    fields = {run.record.manifest.field_of_view for run in runs}
    return Results(
        runs=tuple(runs),
        pooled=tuple(
            result for label in styles for mode in MODES if (result := _pooled(label, mode, runs)) is not None
        ),
        left_out=left_out,
        diameter_m=diameters.pop() if len(diameters) == 1 else None,
        field_of_view=fields.pop() if len(fields) == 1 else None,
    )


def _pooled(label: str, mode: str, everything: Sequence[Run]) -> MethodResult | None:
    runs = [run for run in everything if run.label == label and run.metrics.mode == mode]
    if not runs:
        return None
    own = [run.metrics for run in runs]
    missing = missing_sequences(own, (run.metrics for run in everything))
    return MethodResult(label, mode, runs[0].style, tuple(runs), tuple(missing), pool(own, missing))


def _overall_rank(results: tuple[MethodResult | None, ...]) -> tuple[bool, float, float, str]:
    present = [result for result in results if result is not None]
    completeness = math.fsum(result.pooled.completeness for result in present) / len(present)
    values = [result.pooled.position.precision_m for result in present]
    defined = [value for value in values if value is not None]
    E = math.fsum(defined) / len(defined) if defined else math.inf
    return (present[0].is_reference, -completeness, E, present[0].label)
