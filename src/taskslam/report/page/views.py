"""What the page shows of a run and of a scenario: numbers with their pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from taskslam.errors import RecordError
from taskslam.evaluation import WaypointMetrics
from taskslam.evaluation.curves import EXACT_RANGE
from taskslam.evaluation.pooled import pooled_precisions
from taskslam.evaluation.quantities.success import POSITION_M, success_curve
from taskslam.geometry import SE2
from taskslam.mode import Mode
from taskslam.report import words
from taskslam.report.floor import floor_plan
from taskslam.report.page.arrivals_figure import arrivals_figures
from taskslam.report.page.curve_figure import Curve, curve_figure, enlarged_limit
from taskslam.report.page.error_bars import bar_limit, error_bars
from taskslam.report.page.failure_marks import FailurePlace
from taskslam.report.page.failures import FailureView, failure_views
from taskslam.report.page.over_time_figure import error_figure, frames_figure
from taskslam.report.page.photos import MeasuredView, measured_view
from taskslam.report.page.replay import Replay, replay_of
from taskslam.report.page.tour_figure import tour_figure
from taskslam.report.page.waypoints_figure import waypoints_figure
from taskslam.report.results import MODES, MethodResult, Run, pooled_results
from taskslam.report.tracks import Tracks
from taskslam.world import FloorPlan

_PANEL_SIZE = (440.0, 310.0)


@dataclass(frozen=True)
class WaypointView:
    """A waypoint with its pictures."""

    metrics: WaypointMetrics
    arrivals: Markup
    bars: Markup


@dataclass(frozen=True)
class RunView(Run):
    """A run with its pictures. anchor: where the page's links point.

    round_names: of the rounds that began. damage: trajectories that could not be read, and why. measured: what cameras
    saw, of a real robot. replay: None without a trajectory. error_over_time, frames_over_time: None where unknown.
    """

    anchor: str
    plan: FloorPlan | None
    tour: Markup
    waypoints: tuple[WaypointView, ...]
    mean_bars: Markup
    failures: tuple[FailureView, ...]
    damage: tuple[str, ...]
    measured: MeasuredView | None
    round_names: tuple[str, ...]
    replay: Replay | None
    error_over_time: Markup | None
    frames_over_time: Markup | None

    def shade(self, waypoint: WaypointMetrics) -> str:
        """How dark a cell of the matrix is, 0 at E = 1 mm to 1 at 1 m, by its logarithm."""
        E = waypoint.position.precision_m
        return "0" if E is None else f"{min(max(math.log10(max(E, 1e-3) / 1e-3) / 3, 0.0), 1.0):.2f}"


@dataclass(frozen=True)
class CurvePanel:
    """One figure of a row and what it shows. mode: the mode that it is about, or None."""

    caption: str
    mode: str | None
    figure: Markup


@dataclass(frozen=True)
class ScenarioView:
    """The runs of one scenario, comparable with one another. configurations: how many differ under this name.

    rows: these runs pooled over seeds, in a suite.
    """

    name: str
    title: str
    runs: tuple[RunView, ...]
    rows: tuple[MethodResult, ...]
    curves: tuple[CurvePanel, ...]
    successes: tuple[CurvePanel, ...]
    failures: tuple[tuple[RunView, FailureView], ...]
    waypoints_plan: Markup
    configurations: int

    @property
    def anchor(self) -> str:
        """Where the page's links point."""
        return _anchor(self.runs)

    @property
    def most_waypoints(self) -> int:
        """Goals of the run that has most: columns of a table."""
        return max(len(run.waypoints) for run in self.runs)


def run_view(anchor: str, run: Run) -> RunView:
    """One run with its pictures."""
    record, metrics, units = run.record, run.metrics, run.units
    limit = bar_limit(metrics)
    tolerance = run.manifest.goal_tolerance
    plan = floor_plan(record.directory)
    tracks = Tracks(record)
    tour = tour_figure(record, metrics, plan, tracks)
    names = tuple(metrics.round_name(start.round) for start in record.rounds())
    replay = replay_of(record, plan, tracks, names)
    error_over_time = error_figure(record, tracks, names, run.style.colour)
    frames_over_time, unread = frames_figure(record, names, run.style.colour)
    failures = failure_views(record, metrics, plan, tracks)
    damage = [*tracks.damage, *unread]
    try:
        measured = measured_view(record, metrics)
    except RecordError as error:
        measured, damage = None, [*damage, str(error)]
    arrivals = arrivals_figures(metrics.waypoints, tolerance, units, metrics.truth_frame == "map")
    return RunView(
        label=run.label,
        style=run.style,
        record=record,
        metrics=metrics,
        anchor=anchor,
        plan=plan,
        tour=tour,
        waypoints=tuple(
            WaypointView(waypoint, figure, error_bars(waypoint.control, waypoint.estimation, limit, units))
            for waypoint, figure in zip(metrics.waypoints, arrivals, strict=True)
        ),
        mean_bars=error_bars(metrics.control, metrics.estimation, limit, units),
        failures=failures,
        damage=tuple(damage),
        measured=measured,
        round_names=names,
        replay=replay,
        error_over_time=error_over_time,
        frames_over_time=frames_over_time,
    )


def scenario_view(runs: Sequence[RunView], in_suite: bool) -> ScenarioView:
    """The runs of one scenario.

    in_suite: best runs first, and one curve figure a mode, over all seeds and with markers.
    """
    runs = sorted(runs, key=lambda run: run.rank) if in_suite else runs
    first = runs[0].manifest
    pooled = pooled_results(runs) if in_suite else None
    rows = tuple(row for mode in pooled.modes for row in pooled.in_mode(mode)) if pooled else ()
    failures = tuple((run, failure) for run in runs for failure in run.failures)
    plan = next((run.plan for run in runs if run.plan is not None), None)
    return ScenarioView(
        name=first.scenario_name,
        title=first.title,
        runs=tuple(runs),
        rows=rows,
        curves=_curves_by_mode(rows, first.robot_diameter) if in_suite else _curves(runs),
        successes=() if in_suite else success_panels(runs, first.robot_diameter, False, _PANEL_SIZE),
        failures=failures,
        waypoints_plan=waypoints_figure(
            plan, first.start, first.goals, _always_reached(runs), _failure_places(failures), _anchor(runs)
        ),
        configurations=len({run.manifest.scenario_hash for run in runs}),
    )


def curve_of(of: Run | MethodResult, precisions: tuple[float, ...], planned: int, marked: bool) -> Curve:
    """The cumulative curve of a run, or of a method in one mode. precisions: E in metres of its complete waypoints."""
    return Curve(precisions, planned, of.style, of.mode == Mode.WITHOUT_MAP, marked, of.name)


def _run_curves(runs: Sequence[Run]) -> list[Curve]:
    """Those of the runs that have a precision at all."""
    return [
        curve_of(run, pooled_precisions([run.metrics]), run.metrics.planned_waypoints, marked=False)
        for run in runs
        if run.metrics.rounds > 1
    ]


def _curves(runs: Sequence[RunView]) -> tuple[CurvePanel, ...]:
    curves = _run_curves(runs)
    if not curves:
        return ()
    D = runs[0].manifest.robot_diameter
    enlarged = enlarged_limit(curves, D)
    return (
        CurvePanel(f"The first {100 * enlarged:g} cm, where they differ", None, curve_figure(curves, enlarged, D)),
        CurvePanel("Up to four robot diameters", None, curve_figure(curves, 4 * D, D)),
    )


def success_panels(
    of: Sequence[Run | MethodResult], diameter_m: float | None, marked: bool, size: tuple[float, float]
) -> tuple[CurvePanel, ...]:
    """Success over position tolerances, a panel for each mode, on one axis."""
    by_mode: dict[str, list[Curve]] = {}
    for one in of:
        runs, missing = (one.runs, one.missing) if isinstance(one, MethodResult) else ((one,), ())
        found = success_curve([run.metrics for run in runs], missing)
        if found is not None:
            by_mode.setdefault(one.mode, []).append(curve_of(one, *found, marked))
    curves = [curve for own in by_mode.values() for curve in own]
    if not curves:
        return ()
    limit = enlarged_limit(curves, diameter_m or EXACT_RANGE / 4, least=2 * POSITION_M)
    label = "position tolerance about the mean, cm"
    return tuple(
        CurvePanel(words.mode(mode).capitalize(), mode, curve_figure(by_mode[mode], limit, diameter_m, size, label))
        for mode in MODES
        if mode in by_mode
    )


def _curves_by_mode(rows: Sequence[MethodResult], D: float) -> tuple[CurvePanel, ...]:
    """One panel for each mode, on one enlarged axis."""
    by_mode = {
        mode: [
            curve_of(row, row.pooled.precisions_m, row.pooled.planned_waypoints, marked=True)
            for row in rows
            if row.mode == mode and row.pooled.area.exact is not None
        ]
        for mode in MODES
    }
    limit = enlarged_limit([curve for curves in by_mode.values() for curve in curves], D)
    return tuple(
        CurvePanel(words.mode(mode).capitalize(), mode, curve_figure(curves, limit, D, _PANEL_SIZE))
        for mode, curves in by_mode.items()
        if curves
    )


def _always_reached(runs: Sequence[RunView]) -> list[bool]:
    """For each goal of the first run, whether every run reached it in every round."""
    goals = range(len(runs[0].waypoints))
    return [all(goal < len(run.waypoints) and run.waypoints[goal].metrics.complete for run in runs) for goal in goals]


def _anchor(runs: Sequence[RunView]) -> str:
    return f"scenario-of-{runs[0].anchor}"


def _failure_places(failures: Sequence[tuple[RunView, FailureView]]) -> list[FailurePlace]:
    """Failures with a known place, numbered as in the list of all."""
    return [
        FailurePlace(number, SE2(*view.failure.truth), run.style.key, run.metrics.mode)
        for number, (run, view) in enumerate(failures, start=1)
        if view.failure.truth is not None
    ]
