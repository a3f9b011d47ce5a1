"""What the page shows of a run and of a scenario: numbers with their pictures."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from taskslam.errors import FloorPlanError
from taskslam.evaluation import RunMetrics, WaypointMetrics
from taskslam.evaluation.metrics_file import Failure
from taskslam.evaluation.pooled import pool
from taskslam.geometry import SE2
from taskslam.record import Manifest, RunRecord
from taskslam.report import words
from taskslam.report.arrivals_figure import arrivals_figures
from taskslam.report.curve_figure import Curve, curve_figure, enlarged_limit
from taskslam.report.error_bars import bar_limit, error_bars, waypoint_bars
from taskslam.report.failure_figure import failure_figure
from taskslam.report.markers import Style, marker_icon
from taskslam.report.tour_figure import tour_figure
from taskslam.world import FloorPlan
from taskslam.world.map_server import load_floor_plan

MODES = ("without-map", "with-map")


@dataclass(frozen=True)
class WaypointView:
    """A waypoint with its pictures."""

    metrics: WaypointMetrics
    arrivals: Markup
    bars: Markup


@dataclass(frozen=True)
class RunView:
    """A run with its pictures. anchor: where the page's links point; label: the method's name on this page."""

    anchor: str
    label: str
    metrics: RunMetrics
    manifest: Manifest
    style: Style
    plan: FloorPlan | None
    tour: Markup
    waypoints: tuple[WaypointView, ...]
    mean_bars: Markup

    @property
    def name(self) -> str:
        """Method and mode."""
        return f"{self.label}, {words.mode(self.metrics.mode)}"

    @property
    def colour(self) -> str:
        """The method's colour."""
        return self.style.colour

    @property
    def icon(self) -> Markup:
        """The method's marker, filled if every waypoint was reached every time."""
        return marker_icon(self.style, self.label, self.metrics.complete_waypoints == self.metrics.planned_waypoints)

    @property
    def method_icon(self) -> Markup:
        """The method's marker, as on a curve."""
        return marker_icon(self.style, self.label)

    @property
    def rank(self) -> tuple[int, float, float, str, int]:
        """Sorts by mode, then completeness, then E."""
        metrics = self.metrics
        E = math.inf if metrics.position.precision_m is None else metrics.position.precision_m
        return (MODES.index(metrics.mode), -metrics.completeness, E, self.label, metrics.seed)


@dataclass(frozen=True)
class CurvePanel:
    """One cumulative curve figure and what it shows."""

    caption: str
    figure: Markup


@dataclass(frozen=True)
class ScenarioView:
    """The runs of one scenario, comparable with one another. configurations: how many differ under this name."""

    name: str
    title: str
    runs: tuple[RunView, ...]
    curves: tuple[CurvePanel, ...]
    failures: tuple[tuple[RunView, Failure], ...]
    failure_plan: Markup | None
    configurations: int

    @property
    def anchor(self) -> str:
        """Where the page's links point."""
        return f"scenario-of-{self.runs[0].anchor}"


def run_view(anchor: str, label: str, record: RunRecord, metrics: RunMetrics, style: Style) -> RunView:
    """One run with its pictures."""
    limit = bar_limit(metrics)
    tolerance = record.manifest.goal_tolerance
    plan = _floor_plan(record.directory)
    return RunView(
        anchor=anchor,
        label=label,
        metrics=metrics,
        manifest=record.manifest,
        style=style,
        plan=plan,
        tour=tour_figure(record, metrics, plan),
        waypoints=tuple(
            WaypointView(waypoint, arrivals, waypoint_bars(waypoint, limit))
            for waypoint, arrivals in zip(
                metrics.waypoints, arrivals_figures(metrics.waypoints, tolerance), strict=True
            )
        ),
        mean_bars=error_bars(metrics.control, metrics.estimation, limit),
    )


def scenario_view(runs: Sequence[RunView], in_suite: bool) -> ScenarioView:
    """The runs of one scenario.

    in_suite: best runs first, one curve figure a mode, with markers, and the failures on a floor plan.
    """
    runs = sorted(runs, key=lambda run: run.rank) if in_suite else runs
    first = runs[0].manifest
    failures = tuple((run, failure) for run in runs for failure in run.metrics.failures)
    return ScenarioView(
        name=first.scenario_name,
        title=first.title,
        runs=tuple(runs),
        curves=_curves_by_mode(runs) if in_suite else _curves(runs),
        failures=failures,
        failure_plan=_failure_plan(runs, [failure for _, failure in failures]) if in_suite else None,
        configurations=len({run.manifest.scenario_hash for run in runs}),
    )


def method_labels(manifests: Sequence[Manifest]) -> list[str]:
    """The name of each run's method; where one was run with several options or latencies, with what differs."""
    variants: dict[str, set[str]] = {}
    latencies: dict[str, set[str]] = {}
    for manifest in manifests:
        variants.setdefault(manifest.method, set()).add(json.dumps(manifest.method_options, sort_keys=True))
        latencies.setdefault(manifest.method, set()).add(manifest.latency)
    labels = []
    for manifest in manifests:
        parts = []
        if len(variants[manifest.method]) > 1:
            options = sorted(manifest.method_options.items())
            parts += [f"{key} = {value}" for key, value in options] or ["default options"]
        if len(latencies[manifest.method]) > 1:
            parts.append(f"{manifest.latency} latency")
        labels.append(f"{manifest.method} ({', '.join(parts)})" if parts else manifest.method)
    return labels


def curve_of(runs: Sequence[RunView], missing: Sequence[int] = (), marked: bool = False) -> Curve:
    """The cumulative curve of one method's runs in one mode, pooled."""
    pooled = pool([run.metrics for run in runs], missing)
    return Curve(
        precisions=pooled.precisions_m,
        planned=pooled.planned_waypoints,
        style=runs[0].style,
        dashed=runs[0].metrics.mode == "without-map",
        marked=marked,
    )


def _curves(runs: Sequence[RunView]) -> tuple[CurvePanel, ...]:
    curves = [curve_of([run]) for run in runs if run.metrics.rounds > 1]
    if not curves:
        return ()
    D = runs[0].manifest.robot_diameter
    enlarged = enlarged_limit(curves, D)
    return (
        CurvePanel("Up to four robot diameters", curve_figure(curves, 4 * D, D)),
        CurvePanel(f"The first {100 * enlarged:g} cm, enlarged", curve_figure(curves, enlarged, D)),
    )


def _curves_by_mode(runs: Sequence[RunView]) -> tuple[CurvePanel, ...]:
    """One panel for each mode, on one enlarged axis."""
    by_mode = {
        mode: [curve_of([run], marked=True) for run in runs if run.metrics.mode == mode and run.metrics.rounds > 1]
        for mode in MODES
    }
    D = runs[0].manifest.robot_diameter
    limit = max(D, enlarged_limit([curve for curves in by_mode.values() for curve in curves], D))
    return tuple(
        CurvePanel(words.mode(mode).capitalize(), curve_figure(curves, limit, D, (440.0, 310.0)))
        for mode, curves in by_mode.items()
        if curves
    )


def _failure_plan(runs: Sequence[RunView], failures: Sequence[Failure]) -> Markup | None:
    """All failures on one plan; None if none has a known place."""
    places = [(number, SE2(*at.truth)) for number, at in enumerate(failures, start=1) if at.truth is not None]
    if not places:
        return None
    plan = next((run.plan for run in runs if run.plan is not None), None)
    return failure_figure(plan, runs[0].manifest.start, runs[0].manifest.goals, places)


def _floor_plan(directory: Path) -> FloorPlan | None:
    """The run's own copy of the floor plan; a run without a readable one is drawn on white."""
    try:
        return load_floor_plan(directory / "plan.yaml")
    except FloorPlanError:
        return None
