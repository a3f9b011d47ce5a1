"""The overview of a suite: every method over all scenarios, in the paper's figures and one table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from markupsafe import Markup

from taskslam.evaluation.curves import EXACT_RANGE
from taskslam.evaluation.metrics_file import Interval
from taskslam.report import words
from taskslam.report.log_axis import LogAxis, log_axis
from taskslam.report.page.curve_figure import curve_figure, enlarged_limit
from taskslam.report.page.scatter_figure import HEADING, POSITION, Errors, Point, scatter_axis, scatter_figure
from taskslam.report.page.views import CurvePanel, ScenarioView, curve_of, success_panels
from taskslam.report.page.violin_figure import MOST_TICKS, violin_strip
from taskslam.report.results import Method, MethodResult, Results

_Means: TypeAlias = tuple[float | None, float | None, Interval | None, Interval | None]
"""Accuracy and precision of a method, and their intervals, in metres or radians."""

_CURVE_SIZE = (380.0, 290.0)  # smaller than a scenario's: three columns stand beside one another


@dataclass(frozen=True)
class SuiteView:
    """Everything of the overview."""

    results: Results
    scenarios: tuple[ScenarioView, ...]
    scatters: tuple[CurvePanel, ...]
    heading_scatters: tuple[CurvePanel, ...]
    curves: tuple[CurvePanel, ...]
    successes: tuple[CurvePanel, ...]
    violin_axis: LogAxis

    def violin(self, method: Method) -> Markup:
        """E over a method's waypoints."""
        without, with_map = (at.pooled.precisions_m if at else () for at in (method.without_map, method.with_map))
        return violin_strip(without, with_map, self.violin_axis, method.style.colour, method.label)

    def violin_ticks(self, unit: float) -> list[tuple[float, float]]:
        """Numbers of units and where they stand on the violins' axis in percent."""
        most = MOST_TICKS if unit == 0.01 else 4  # `0.002 D` is long, and a phone narrow
        axis = self.violin_axis
        return [(tick, 100 * axis.share(tick * unit)) for tick in axis.ticks(unit, most)]

    @property
    def title(self) -> str:
        """The one scenario's title, or how many there are."""
        if len(self.scenarios) == 1:
            return self.scenarios[0].title
        return f"{self.who} in {len(self.scenarios)} scenarios"

    @property
    def who(self) -> str:
        """How many methods; references apart."""
        references = sum(method.is_reference for method in self.results.methods)
        counts = [(len(self.results.methods) - references, "method"), (references, "reference")]
        return " and ".join(words.count(number, what) for number, what in counts if number)

    def absent(self, mode: str) -> list[str]:
        """Methods that have no run in a mode and a run in another."""
        present = {result.label for result in self.results.in_mode(mode)}
        return [method.label for method in self.results.methods if method.label not in present]


def is_suite(results: Results) -> bool:
    """Whether these runs call for an overview: more than one scenario, more than two methods, or several seeds."""
    return len(results.scenarios) > 1 or len(results.methods) > 2 or results.several_seeds


def suite_view(results: Results, scenarios: Sequence[ScenarioView]) -> SuiteView:
    """Draw the overview of all methods."""
    knows_headings = any(None not in _heading(result)[:2] for result in results.pooled)
    return SuiteView(
        results=results,
        scenarios=tuple(scenarios),
        scatters=_scatters(results, POSITION, results.units.diameter_m, _position),
        heading_scatters=_scatters(results, HEADING, None, _heading) if knows_headings else (),
        curves=_curves(results),
        successes=success_panels(results.pooled, results.units.diameter_m, True, _CURVE_SIZE),
        violin_axis=log_axis([value for result in results.pooled for value in result.pooled.precisions_m]),
    )


def _scatters(
    results: Results, errors: Errors, diameter_m: float | None, means: Callable[[MethodResult], _Means]
) -> tuple[CurvePanel, ...]:
    """A panel for each mode, on one axis. diameter_m: of the second axes, None without."""
    points = {
        mode: [point for result in results.in_mode(mode) if (point := _point(result, *means(result)))]
        for mode in results.modes
    }
    axis = scatter_axis([point for panel in points.values() for point in panel], errors)
    return tuple(
        CurvePanel(
            words.mode(mode).capitalize(),
            mode,
            scatter_figure(panel, axis, diameter_m, f"{errors.of}, {words.mode(mode)}", errors),
        )
        for mode, panel in points.items()
    )


def _position(result: MethodResult) -> _Means:
    found, between = result.pooled.position, result.pooled.uncertainty
    return found.accuracy_m, found.precision_m, between.accuracy_m, between.precision_m


def _heading(result: MethodResult) -> _Means:
    found, between = result.pooled.orientation, result.pooled.uncertainty
    return found.accuracy_rad, found.precision_rad, between.accuracy_rad, between.precision_rad


def _point(
    result: MethodResult,
    accuracy: float | None,
    precision: float | None,
    accuracy_interval: Interval | None,
    precision_interval: Interval | None,
) -> Point | None:
    if accuracy is None or precision is None:
        return None
    between = accuracy_interval, precision_interval
    return Point(result.label, accuracy, precision, result.complete, result.style, *between)


def _curves(results: Results) -> tuple[CurvePanel, ...]:
    """For each mode the whole curve over 120 cm and its beginning, on axes shared between modes."""
    diameter = results.units.diameter_m
    curves = {
        mode: [
            curve_of(result, result.pooled.precisions_m, result.pooled.planned_waypoints, marked=True)
            for result in results.in_mode(mode)
            if result.pooled.area.exact is not None
        ]
        for mode in results.modes
    }
    near = enlarged_limit([curve for panel in curves.values() for curve in panel], diameter or EXACT_RANGE / 4)
    extents = (
        (near, f"the first {100 * near:g} cm, where they differ"),
        (EXACT_RANGE, f"up to {100 * EXACT_RANGE:g} cm"),
    )
    return tuple(
        CurvePanel(f"{words.mode(mode).capitalize()}, {what}", mode, curve_figure(panel, limit, diameter, _CURVE_SIZE))
        for limit, what in extents
        for mode, panel in curves.items()
        if panel
    )
