"""The overview of a suite: every method over all scenarios, in the paper's figures and one table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from taskslam.evaluation.curves import EXACT_RANGE
from taskslam.evaluation.pooled import Pooled, missing_sequences, pool
from taskslam.report import words
from taskslam.report.curve_figure import curve_figure, enlarged_limit
from taskslam.report.log_axis import LogAxis, log_axis
from taskslam.report.markers import Style, marker_icon
from taskslam.report.scatter_figure import Point, scatter_axis, scatter_figure
from taskslam.report.units import Units
from taskslam.report.views import MODES, CurvePanel, RunView, ScenarioView, curve_of
from taskslam.report.violin_figure import MOST_TICKS, violin_strip

_CURVE_SIZE = (380.0, 290.0)  # smaller than a scenario's: three columns stand beside one another


@dataclass(frozen=True)
class Entry:
    """One method in one mode, pooled over the scenarios."""

    name: str
    mode: str
    runs: tuple[RunView, ...]
    missing: tuple[int, ...]
    pooled: Pooled
    style: Style

    @property
    def complete(self) -> bool:
        """Whether every waypoint of every sequence was reached every time."""
        return self.pooled.complete_waypoints == self.pooled.planned_waypoints

    @property
    def icon(self) -> Markup:
        """The method's marker, filled if complete."""
        return marker_icon(self.style, self.name, self.complete)

    @property
    def is_reference(self) -> bool:
        """Whether the method is told the truth."""
        return self.runs[0].manifest.is_reference

    @property
    def rank(self) -> tuple[float, float, str]:
        """Sorts by completeness, then by E."""
        E = self.pooled.position.precision_m
        return (-self.pooled.completeness, float("inf") if E is None else E, self.name)


@dataclass(frozen=True)
class MethodView:
    """One method in both modes; a mode in which it never ran is None."""

    name: str
    style: Style
    card: Mapping[str, Any]
    without_map: Entry | None
    with_map: Entry | None
    violin: Markup

    @property
    def icon(self) -> Markup:
        """The method's marker."""
        return marker_icon(self.style, self.name)

    @property
    def entries(self) -> list[Entry]:
        """The modes that it ran in."""
        return [entry for entry in (self.without_map, self.with_map) if entry is not None]

    @property
    def completeness_label(self) -> str:
        """`(C_wo | C_w)` in percent, as under the paper's violins (protocol 5.6)."""
        shares = [words.percent(entry.pooled.completeness) if entry else words.DASH for entry in
                  (self.without_map, self.with_map)]  # fmt: skip
        return f"({' | '.join(shares)})"


@dataclass(frozen=True)
class SuiteView:
    """Everything of the overview. diameter_m, field_of_view: the task's units, None where scenarios differ."""

    methods: tuple[MethodView, ...]
    scenarios: tuple[ScenarioView, ...]
    modes: tuple[str, ...]
    scatters: tuple[CurvePanel, ...]
    curves: tuple[CurvePanel, ...]
    violin_axis: LogAxis
    diameter_m: float | None
    field_of_view: float | None
    rounds: tuple[int, ...]

    def violin_ticks(self, unit: float) -> list[tuple[float, float]]:
        """Numbers of units and where they stand on the violins' axis in percent."""
        most = MOST_TICKS if unit == 0.01 else 4  # `0.002 D` is long, and a phone narrow
        axis = self.violin_axis
        return [(tick, 100 * axis.share(tick * unit)) for tick in axis.ticks(unit, most)]

    def ranked(self, mode: str) -> list[Entry]:
        """Methods in one mode, the most complete and then the most precise first."""
        entries = [entry for method in self.methods for entry in method.entries if entry.mode == mode]
        return sorted(entries, key=lambda entry: entry.rank)

    @property
    def units(self) -> Units:
        """What the task measures in."""
        return Units(self.diameter_m, self.field_of_view)

    @property
    def title(self) -> str:
        """The one scenario's title, or how many there are."""
        if len(self.scenarios) == 1:
            return self.scenarios[0].title
        return f"{self.who} in {len(self.scenarios)} scenarios"

    @property
    def who(self) -> str:
        """How many methods; references apart."""
        references = sum(method.entries[0].is_reference for method in self.methods)
        counts = [(len(self.methods) - references, "method"), (references, "reference")]
        return " and ".join(words.count(number, what) for number, what in counts if number)

    def absent(self, mode: str) -> list[str]:
        """Methods that have no run in a mode and a run in another."""
        return [method.name for method in self.methods if all(entry.mode != mode for entry in method.entries)]

    @property
    def waypoints(self) -> int:
        """Planned waypoints of one method in one mode, over all sequences."""
        return max(entry.pooled.planned_waypoints for method in self.methods for entry in method.entries)


def is_suite(runs: Sequence[RunView]) -> bool:
    """Whether these runs call for an overview: more than one scenario, or more than two methods."""
    return len({run.metrics.scenario for run in runs}) > 1 or len({run.label for run in runs}) > 2


def suite_view(runs: Sequence[RunView], scenarios: Sequence[ScenarioView]) -> SuiteView:
    """Pool the runs of every method and draw the overview."""
    entries = [
        entry
        for name in dict.fromkeys(run.label for run in runs)
        for mode in MODES
        if (entry := _entry([run for run in runs if run.label == name and run.metrics.mode == mode], runs)) is not None
    ]
    diameters = {run.manifest.robot_diameter for run in runs}
    fields = {run.manifest.field_of_view for run in runs}
    diameter = diameters.pop() if len(diameters) == 1 else None
    axis = log_axis([value for entry in entries for value in entry.pooled.precisions_m])
    methods = [_method(name, entries, axis) for name in dict.fromkeys(entry.name for entry in entries)]
    return SuiteView(
        methods=tuple(sorted(methods, key=lambda method: method.entries[-1].rank)),
        scenarios=tuple(scenarios),
        modes=tuple(mode for mode in MODES if any(entry.mode == mode for entry in entries)),
        scatters=_scatters(entries, diameter),
        curves=_curves(entries, diameter),
        violin_axis=axis,
        diameter_m=diameter,
        field_of_view=fields.pop() if len(fields) == 1 else None,
        rounds=tuple(sorted({run.metrics.rounds for run in runs})),
    )


def _entry(runs: Sequence[RunView], everything: Sequence[RunView]) -> Entry | None:
    if not runs:
        return None
    own = [run.metrics for run in runs]
    missing = missing_sequences(own, (run.metrics for run in everything))
    first = runs[0]
    return Entry(first.label, first.metrics.mode, tuple(runs), tuple(missing), pool(own, missing), first.style)


def _method(name: str, entries: Sequence[Entry], axis: LogAxis) -> MethodView:
    by_mode = {entry.mode: entry for entry in entries if entry.name == name}
    without, with_map = (by_mode.get(mode) for mode in MODES)
    first = next(iter(by_mode.values()))
    samples = [entry.pooled.precisions_m if entry else () for entry in (without, with_map)]
    return MethodView(
        name=name,
        style=first.style,
        card=first.runs[0].manifest.method_card,
        without_map=without,
        with_map=with_map,
        violin=violin_strip(samples[0], samples[1], axis, first.style.colour, name),
    )


def _scatters(entries: Sequence[Entry], diameter: float | None) -> tuple[CurvePanel, ...]:
    points = {mode: [point for entry in entries if entry.mode == mode and (point := _point(entry))] for mode in MODES}
    axis = scatter_axis([point for panel in points.values() for point in panel])
    return tuple(
        CurvePanel(
            words.mode(mode).capitalize(),
            mode,
            scatter_figure(points[mode], axis, diameter, f"Precision against accuracy, {words.mode(mode)}"),
        )
        for mode in MODES
        if any(entry.mode == mode for entry in entries)
    )


def _point(entry: Entry) -> Point | None:
    pooled = entry.pooled
    E, e = pooled.position.precision_m, pooled.position.accuracy_m
    if E is None or e is None:
        return None
    between = pooled.uncertainty
    return Point(entry.name, e, E, entry.complete, entry.style, between.accuracy_m, between.precision_m)


def _curves(entries: Sequence[Entry], diameter: float | None) -> tuple[CurvePanel, ...]:
    """For each mode the whole curve over 120 cm and its beginning, on axes shared between modes."""
    curves = {
        mode: [
            curve_of(entry.runs, entry.missing, marked=True)
            for entry in entries
            if entry.mode == mode and entry.pooled.n_auc.exact is not None
        ]
        for mode in MODES
    }
    near = enlarged_limit([curve for panel in curves.values() for curve in panel], diameter or EXACT_RANGE / 4)
    panels = []
    for limit, what in (
        (EXACT_RANGE, f"up to {100 * EXACT_RANGE:g} cm"),
        (near, f"the first {100 * near:g} cm, enlarged"),
    ):
        panels += [
            CurvePanel(
                f"{words.mode(mode).capitalize()}, {what}",
                mode,
                curve_figure(curves[mode], limit, diameter, _CURVE_SIZE),
            )
            for mode in MODES
            if curves[mode]
        ]
    return tuple(panels)
