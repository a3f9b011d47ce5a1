"""One self-contained page: verdict first, then the pictures and tables that support it, then what was run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from taskslam.errors import FloorPlanError
from taskslam.evaluation import RunMetrics, WaypointMetrics, read_runs
from taskslam.record import Manifest, RunRecord
from taskslam.record.files import write_whole, writing
from taskslam.report import palette, words
from taskslam.report.arrivals_figure import arrivals_figures
from taskslam.report.curve_figure import Curve, curve_figure, enlarged_limit
from taskslam.report.error_bars import bar_limit, error_bars, waypoint_bars
from taskslam.report.tour_figure import tour_figure
from taskslam.world import FloorPlan
from taskslam.world.map_server import load_floor_plan


@dataclass(frozen=True)
class WaypointView:
    """A waypoint with its pictures."""

    metrics: WaypointMetrics
    arrivals: Markup
    bars: Markup


@dataclass(frozen=True)
class RunView:
    """A run with its pictures. anchor: where the page's links point."""

    anchor: str
    metrics: RunMetrics
    manifest: Manifest
    colour: str
    tour: Markup
    waypoints: tuple[WaypointView, ...]
    mean_bars: Markup

    @property
    def name(self) -> str:
        """Method and mode."""
        return f"{self.metrics.method}, {words.mode(self.metrics.mode)}"


@dataclass(frozen=True)
class ScenarioView:
    """The runs of one scenario, comparable with one another."""

    name: str
    title: str
    runs: tuple[RunView, ...]
    curve: Markup | None
    enlarged_curve: Markup | None
    enlarged_limit_m: float

    @property
    def failures(self) -> list[tuple[RunView, object]]:
        """Every failure of every run."""
        return [(run, failure) for run in self.runs for failure in run.metrics.failures]


def write_report(folders: Sequence[Path], out: Path) -> Path:
    """Write the page about all finished runs at or below the given folders; returns its path.

    Runs that cannot be read are named on the page and left out. Raises RecordError if there is no run at all,
    DiskFullError if the page cannot be written.
    """
    read, left_out = read_runs(folders)
    colours = palette.method_colours([metrics.method for _, metrics in read])
    views = [
        _run_view(f"run-{index}", record, metrics, colours[metrics.method])
        for index, (record, metrics) in enumerate(read, start=1)
    ]
    scenarios = [
        _scenario_view([view for view in views if view.metrics.scenario == name])
        for name in sorted({view.metrics.scenario for view in views})
    ]
    environment = Environment(
        loader=PackageLoader("taskslam.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    style = resources.files("taskslam.report").joinpath("templates", "style.css").read_text(encoding="utf-8")
    text = environment.get_template("report.html").render(
        scenarios=scenarios,
        left_out=left_out,
        words=words,
        palette=palette,
        style=Markup(style),  # noqa: S704 our own file, no input in it
    )
    with writing(out):
        out.absolute().parent.mkdir(parents=True, exist_ok=True)
    write_whole(out, text)
    return out


def _run_view(anchor: str, record: RunRecord, metrics: RunMetrics, colour: str) -> RunView:
    limit = bar_limit(metrics)
    tolerance = record.manifest.goal_tolerance
    return RunView(
        anchor=anchor,
        metrics=metrics,
        manifest=record.manifest,
        colour=colour,
        tour=tour_figure(record, metrics, _floor_plan(record.directory)),
        waypoints=tuple(
            WaypointView(waypoint, arrivals, waypoint_bars(waypoint, limit))
            for waypoint, arrivals in zip(
                metrics.waypoints, arrivals_figures(metrics.waypoints, tolerance), strict=True
            )
        ),
        mean_bars=error_bars(metrics.control, metrics.estimation, limit),
    )


def _scenario_view(runs: list[RunView]) -> ScenarioView:
    first = runs[0].manifest
    curves = [_curve(run) for run in runs if run.metrics.rounds > 1]
    D = first.robot_diameter
    enlarged = enlarged_limit(curves, D)
    return ScenarioView(
        name=first.scenario_name,
        title=first.title,
        runs=tuple(runs),
        curve=curve_figure(curves, 4 * D, D) if curves else None,
        enlarged_curve=curve_figure(curves, enlarged, D) if curves else None,
        enlarged_limit_m=enlarged,
    )


def _curve(run: RunView) -> Curve:
    complete = (w.position.precision_m for w in run.metrics.waypoints if w.complete)
    return Curve(
        precisions=tuple(value for value in complete if value is not None),
        planned=run.metrics.planned_waypoints,
        colour=run.colour,
        dashed=run.metrics.mode == "without-map",
    )


def _floor_plan(directory: Path) -> FloorPlan | None:
    """The run's own copy of the floor plan; a run without a readable one is drawn on white."""
    try:
        return load_floor_plan(directory / "plan.yaml")
    except FloorPlanError:
        return None
