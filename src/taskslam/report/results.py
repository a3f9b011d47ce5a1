"""The results of some folders, ready for the page, figures and tables: who is pooled, in which order and colours.

All of a method's runs in one mode are pooled over all sequences; sequences that others drove and it did not stay in
its denominators (docs/metrics.md).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from statistics import fmean
from typing import Any, TypeAlias

from markupsafe import Markup

from taskslam.errors import InputError, did_you_mean
from taskslam.evaluation import read_runs
from taskslam.evaluation.metrics_file import LeftOut, Measured, RunMetrics
from taskslam.evaluation.names import method_labels
from taskslam.evaluation.pooled import Pooled, missing_sequences, pool
from taskslam.evaluation.quantities import measured
from taskslam.mode import Mode
from taskslam.record import Manifest, RunRecord
from taskslam.report import cards, words
from taskslam.report.markers import Style, marker_icon, method_styles
from taskslam.report.units import Units

MODES = tuple(mode.value for mode in Mode)
Rank: TypeAlias = tuple[bool, float, float, str]


@dataclass(frozen=True)
class Run:
    """One run with the name and style of its method."""

    label: str
    style: Style
    record: RunRecord
    metrics: RunMetrics

    @property
    def manifest(self) -> Manifest:
        """What was run."""
        return self.record.manifest

    @property
    def mode(self) -> str:
        """Without map or with map."""
        return self.metrics.mode

    @property
    def name(self) -> str:
        """Method and mode."""
        return f"{self.label}, {words.mode(self.mode)}"

    @property
    def icon(self) -> Markup:
        """The method's marker, filled if every waypoint was reached every time."""
        return marker_icon(self.style, self.label, self.metrics.complete_waypoints == self.metrics.planned_waypoints)

    @property
    def method_icon(self) -> Markup:
        """The method's marker, as on a curve."""
        return marker_icon(self.style, self.label)

    @property
    def numbers(self) -> RunMetrics:
        """What it took and how it failed."""
        return self.metrics

    @property
    def quantities(self) -> Mapping[str, Measured]:
        """Every quantity by its key."""
        return self.metrics.quantities

    @property
    def units(self) -> Units:
        """What the task measures in."""
        return Units(self.manifest.robot_diameter, self.manifest.field_of_view)

    @property
    def rounds_driven(self) -> int:
        """Rounds that began; not the priming round."""
        return sum(not summary.priming for summary in self.metrics.round_summaries)

    @property
    def rank(self) -> tuple[int, Rank, int]:
        """Sorts by mode, then as methods are sorted."""
        metrics = self.metrics
        own = _rank(self.manifest.is_reference, metrics.completeness, metrics.position.precision_m, self.label)
        return (MODES.index(self.mode), own, metrics.seed)


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
    def name(self) -> str:
        """Method and mode."""
        return self.runs[0].name

    @property
    def numbers(self) -> Pooled:
        """What its runs took and how they failed."""
        return self.pooled

    @cached_property
    def quantities(self) -> Mapping[str, Measured]:
        """Every quantity by its key, over all runs."""
        return measured([run.metrics for run in self.runs], self.missing, self.pooled.uncertainty)

    @property
    def complete(self) -> bool:
        """Whether every waypoint of every sequence was reached in every round."""
        return self.pooled.complete_waypoints == self.pooled.planned_waypoints

    @property
    def icon(self) -> Markup:
        """The method's marker, filled if complete."""
        return marker_icon(self.style, self.label, self.complete)

    @property
    def card(self) -> Mapping[str, Any]:
        """What the method declares, as its first run had it."""
        return self.runs[0].manifest.method_card

    @property
    def sensor(self) -> str:
        """The sensor that it sees with, as cards name it."""
        return cards.main_sensor(self.card)

    @property
    def is_reference(self) -> bool:
        """Whether it is told the truth."""
        return self.runs[0].manifest.is_reference

    @property
    def rank(self) -> Rank:
        """Sorts by completeness, then by E; references last."""
        return _rank(self.is_reference, self.pooled.completeness, self.pooled.position.precision_m, self.label)


@dataclass(frozen=True)
class Method:
    """One method in both modes; a mode in which it never ran is None."""

    without_map: MethodResult | None
    with_map: MethodResult | None

    @property
    def results(self) -> list[MethodResult]:
        """Those of the modes that it ran in."""
        return [result for result in (self.without_map, self.with_map) if result is not None]

    @property
    def label(self) -> str:
        """Its name."""
        return self.results[0].label

    @property
    def style(self) -> Style:
        """How it is drawn."""
        return self.results[0].style

    @property
    def icon(self) -> Markup:
        """Its marker."""
        return marker_icon(self.style, self.label)

    @property
    def is_reference(self) -> bool:
        """Whether it is told the truth."""
        return self.results[0].is_reference

    @property
    def complete(self) -> bool:
        """Whether it is complete in every mode that it ran in."""
        return all(result.complete for result in self.results)

    @property
    def completeness_label(self) -> str:
        """`(C_wo | C_w)` in percent, as beside the paper's violins (protocol 5.6)."""
        both = (self.without_map, self.with_map)
        return f"({' | '.join(words.percent(at.pooled.completeness) if at else words.DASH for at in both)})"

    @property
    def rank(self) -> Rank:
        """Sorts by the mean completeness over its modes, then by the mean E; references last."""
        completeness = fmean(result.pooled.completeness for result in self.results)
        values = [E for result in self.results if (E := result.pooled.position.precision_m) is not None]
        return _rank(self.is_reference, completeness, fmean(values) if values else None, self.label)


@dataclass(frozen=True)
class Results:
    """All runs in the order of their folders, their pooled results, the best method first, and what was left out.

    order: labels of methods that come before the others, whatever they reached.
    """

    runs: tuple[Run, ...]
    methods: tuple[Method, ...]
    left_out: tuple[LeftOut, ...]
    order: tuple[str, ...] = ()

    @property
    def first_runs(self) -> list[Run]:
        """The first run of each method."""
        first: dict[str, Run] = {}
        for run in self.runs:
            first.setdefault(run.label, run)
        return list(first.values())

    @property
    def modes(self) -> tuple[str, ...]:
        """The modes that any method ran in, without map first."""
        return tuple(mode for mode in MODES if any(run.mode == mode for run in self.runs))

    @property
    def rounds(self) -> tuple[int, ...]:
        """Every number M of rounds that a run planned, sorted."""
        return tuple(sorted({run.metrics.rounds for run in self.runs}))

    @property
    def seeds(self) -> tuple[int, ...]:
        """Every seed of any run, sorted."""
        return tuple(sorted({run.metrics.seed for run in self.runs}))

    @property
    def several_seeds(self) -> bool:
        """Whether a method was driven with several seeds: then a run is not named without its own."""
        return any(len({run.metrics.seed for run in result.runs}) > 1 for result in self.pooled)

    @property
    def scenarios(self) -> tuple[str, ...]:
        """Names of the scenarios, sorted."""
        return tuple(sorted({run.metrics.scenario for run in self.runs}))

    @property
    def units(self) -> Units:
        """What the tasks measure in, as far as they agree."""
        return Units(
            _shared(run.manifest.robot_diameter for run in self.runs),
            _shared(run.manifest.field_of_view for run in self.runs),
        )

    @property
    def pooled(self) -> list[MethodResult]:
        """Every method in every mode that it ran in."""
        return [result for method in self.methods for result in method.results]

    def in_scenario(self, name: str) -> Results:
        """The runs of one scenario, pooled anew."""
        return pooled_results([run for run in self.runs if run.metrics.scenario == name], order=self.order)

    def in_mode(self, mode: str) -> list[MethodResult]:
        """Methods in one mode: the most complete first, then the most precise; references last."""
        return sorted(
            (result for result in self.pooled if result.mode == mode),
            key=lambda result: (_place(result.label, self.order), result.rank),
        )


def read_results(folders: Sequence[Path], named: Mapping[str, str] | None = None, order: Sequence[str] = ()) -> Results:
    """The finished runs at or below some folders.

    named: what methods are to be called; order: which come first, by either name.

    Raises:
        RecordError: there is no run, finished or not.
        InputError: no method is called so, or two would be called alike.
    """
    read, left_out = read_runs(folders)
    own = method_labels([metrics for _, metrics in read])
    names = _renamed(own, named or {})
    labels = [names[label] for label in own]
    first = tuple(names.get(_known(label, [*own, *labels], "order"), label) for label in order)
    sensors = {
        label: cards.main_sensor(record.manifest.method_card) for label, (record, _) in zip(labels, read, strict=True)
    }
    styles = method_styles(labels, sensors)
    runs = tuple(Run(label, styles[label], *own) for label, own in zip(labels, read, strict=True))
    return pooled_results(runs, left_out, first)


def _renamed(labels: Sequence[str], named: Mapping[str, str]) -> dict[str, str]:
    """What each method is called. Raises InputError."""
    for label in named:
        _known(label, labels, "label")
    names = {label: named.get(label, label) for label in labels}
    for label, name in named.items():
        if other := next((one for one, called in names.items() if called == name and one != label), None):
            raise InputError(f"label {label}={name}: {other} is called so too; expected a name of its own")
    return names


def _known(label: str, labels: Sequence[str], what: str) -> str:
    if label not in labels:
        known = sorted(set(labels))
        raise InputError(
            f"{what} {label}: no method is called so here; expected one of {', '.join(known) or 'none'}."
            f"{did_you_mean(label, known)}"
        )
    return label


def _place(label: str, order: Sequence[str]) -> int:
    return order.index(label) if label in order else len(order)


def pooled_results(runs: Sequence[Run], left_out: tuple[LeftOut, ...] = (), order: tuple[str, ...] = ()) -> Results:
    """These runs, each method of them pooled in each mode."""
    labels = dict.fromkeys(run.label for run in runs)
    methods = [Method(*(_pooled(label, mode, runs) for mode in MODES)) for label in labels]
    methods.sort(key=lambda method: (_place(method.label, order), method.rank))
    return Results(tuple(runs), tuple(methods), left_out, order)


def _pooled(label: str, mode: str, everything: Sequence[Run]) -> MethodResult | None:
    runs = [run for run in everything if (run.label, run.mode) == (label, mode)]
    if not runs:
        return None
    own = [run.metrics for run in runs]
    missing = missing_sequences(own, (run.metrics for run in everything))
    return MethodResult(label, mode, runs[0].style, tuple(runs), tuple(missing), pool(own, missing))


def _rank(is_reference: bool, completeness: float, E: float | None, label: str) -> Rank:
    return (is_reference, -completeness, math.inf if E is None else E, label)


def _shared(values: Iterable[float]) -> float | None:
    """The value that all are; None where they differ."""
    different = set(values)
    return different.pop() if len(different) == 1 else None
