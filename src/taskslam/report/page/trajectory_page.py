"""Recorded trajectories as one self-contained page: verdict, statistics with intervals, then pictures by sequence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from markupsafe import Markup

from taskslam.files import write_whole
from taskslam.geometry import FloatArray
from taskslam.printable import printable
from taskslam.report import words
from taskslam.report.drawn_run import DrawnRun, Ground, Stretch, box
from taskslam.report.log_axis import LogAxis, log_axis
from taskslam.report.markers import Style, marker_icon, method_styles
from taskslam.report.open_loop_words import cautions, verdict_sentence
from taskslam.report.page.box_figure import MOST_TICKS, box_strip, time_strip
from taskslam.report.page.path_figure import path_figure
from taskslam.report.page.plan_drawing import plan_pictures
from taskslam.report.page.scatter_figure import Point, scatter_axis, scatter_figure
from taskslam.report.page.shell import Entry, render
from taskslam.report.page.time_figure import coordinate_figure, error_figure
from taskslam.report.units import Units
from taskslam.studies.study_results import MethodSummary, OpenLoopResults, OverRuns, RunResult
from taskslam.studies.study_settings import Settings
from taskslam.version import __version__
from taskslam.world import FloorPlan

_MOST_VERDICTS = 6  # results with big numbers; more have their tables alone
_MOST_OPEN_RUNS = 20  # of a sequence; a longer table of them is folded


@dataclass(frozen=True)
class Drawn:
    """What is drawn of a sequence. plan: in the frame of the ground truth, or None."""

    on: Ground
    runs: tuple[DrawnRun, ...]
    plan: FloorPlan | None


@dataclass(frozen=True)
class ResultView:
    """A method on a sequence."""

    result: MethodSummary
    style: Style

    @property
    def icon(self) -> Markup:
        """Its marker, filled if the compared frames are those of all runs."""
        return marker_icon(self.style, self.result.method, self.result.compared_frames is self.result.common)

    @property
    def completeness(self) -> float:
        """Mean over its runs."""
        return sum(run.completeness for run in self.result.runs) / len(self.result.runs)


@dataclass(frozen=True)
class BoxRow:
    """One method's strips for one measure: position and rotation."""

    view: ResultView
    strips: tuple[Markup, Markup]


@dataclass(frozen=True)
class RunRow:
    """One run. name: its file, as short as it is its own."""

    view: ResultView
    run: RunResult
    name: str
    strip: Markup
    diverged: bool


@dataclass(frozen=True)
class SequenceView:
    """A sequence with its pictures. boxes: rows of each measure; ticks: of their axes, in percent of the width."""

    name: str
    anchor: str
    results: tuple[ResultView, ...]
    figures: tuple[tuple[str, Markup], ...]
    paths: Markup
    seen_in: str
    on_map: bool
    boxes: tuple[tuple[str, tuple[BoxRow, ...]], ...]
    ticks: tuple[list[tuple[float, float]], list[tuple[float, float]]]
    rows: tuple[RunRow, ...]


def write_trajectory_page(out: Path, settings: Settings, results: OpenLoopResults, drawn: Mapping[str, Drawn]) -> Path:
    """Write the page; returns its path. drawn: of every sequence. Raises DiskFullError."""
    styles = method_styles([result.method for result in results.results])
    views = [ResultView(result, styles[result.method]) for result in results.results]
    sequences = [
        _sequence(f"sequence-{number}", name, [view for view in views if view.result.sequence == name], drawn[name],
                  styles)
        for number, name in enumerate(dict.fromkeys(result.sequence for result in results.results), start=1)
    ]  # fmt: skip
    notes = _notes(results)
    parts = [("errors", "Errors"), ("precision", "Runs against one another")]
    parts += [(sequence.anchor, sequence.name) for sequence in sequences]
    parts += [("notes", "Left out or guessed")] if notes or results.left_out else []
    points = [point for view in views if (point := _point(view, len(sequences) > 1)) is not None]
    units = Units(results.units.robot_diameter, results.units.field_of_view)
    text = render(
        "trajectories.html",
        [Entry(method, style) for method, style in styles.items()],
        (),
        [*parts, ("how-evaluated", "How it was evaluated"), ("how-to-read", "How to read this")],
        title=_title(results, sequences),
        verdict=verdict_sentence(results),
        results=results,
        units=units,
        task_units=f"D = {100 * results.units.robot_diameter:g} cm, FoV = {results.units.field_of_view:g}°",
        views=views,
        big=len(views) <= _MOST_VERDICTS,
        deltas=list(dict.fromkeys(each.delta for view in views for each in view.result.rpe)),
        sequences=sequences,
        scatter=scatter_figure(points, scatter_axis(points), results.units.robot_diameter, "Precision against accuracy")
        if points
        else None,
        notes=notes,
        facts=_facts(settings, results),
        folded=_MOST_OPEN_RUNS,
        interval=_interval,
        shared=[plan_pictures([each.plan for each in drawn.values() if each.plan is not None])],
        data=Markup('{"modes":[],"scenarios":{},"runs":{}}'),
    )
    write_whole(out, printable(text))
    return out


def _title(results: OpenLoopResults, sequences: Sequence[SequenceView]) -> str:
    methods = list(dict.fromkeys(result.method for result in results.results))
    who = methods[0] if len(methods) == 1 else words.count(len(methods), "method")
    where = sequences[0].name if len(sequences) == 1 else words.count(len(sequences), "sequence")
    return f"{who} on {where}"


def _sequence(
    anchor: str, name: str, views: Sequence[ResultView], drawn: Drawn, styles: Mapping[str, Style]
) -> SequenceView:
    on, runs = drawn.on, drawn.runs
    figures = [
        ("Position error", error_figure(on, runs, styles, "ATE, cm", lambda stretch: stretch.errors)),
        ("Rotation error", error_figure(on, runs, styles, "rotation error, °", _hundredth_degrees)),
    ]
    if on.rises:
        figures.append((f"Coordinate {'xyz'[on.axes[2]]}", coordinate_figure(on, runs, styles)))
    axes = (_axis(runs, 0), _axis(runs, 1))
    boxes = []
    for measure in dict.fromkeys(measure for run in runs for measure in run.spreads):
        rows = [(view, [run for run in runs if run.method == view.result.method]) for view in views]
        boxes.append((measure, tuple(BoxRow(view, _strips(view, own, measure, axes)) for view, own in rows)))
    return SequenceView(
        name=name,
        anchor=anchor,
        results=tuple(views),
        figures=tuple(figures),
        paths=path_figure(on, runs, styles, drawn.plan, name),
        seen_in=" and ".join("xyz"[axis] for axis in on.axes[:2]),
        on_map=drawn.plan is not None,
        boxes=tuple(boxes),
        ticks=(_ticks(axes[0]), _ticks(axes[1])),
        rows=_rows(views, runs, on),
    )


def _hundredth_degrees(stretch: Stretch) -> FloatArray:
    return np.degrees(stretch.turns) / 100


def _axis(runs: Sequence[DrawnRun], part: int) -> LogAxis:
    """The axis of one kind of error over all boxes of a sequence: metres, or hundredths of a degree in their place."""
    measures = {measure for run in runs for measure in run.spreads}
    methods = {run.method for run in runs}
    found = [
        spread
        for measure in measures
        for method in methods
        if (spread := _box([run for run in runs if run.method == method], measure, part)) is not None
    ]
    return log_axis(np.concatenate(found))


def _box(runs: Sequence[DrawnRun], measure: str, part: int) -> FloatArray | None:
    spread = box(runs, measure, part)
    return spread if spread is None or part == 0 else np.degrees(spread) / 100


def _strips(
    view: ResultView, runs: Sequence[DrawnRun], measure: str, axes: tuple[LogAxis, LogAxis]
) -> tuple[Markup, Markup]:
    position, rotation = (
        box_strip(_box(runs, measure, part), axes[part], view.style, f"{view.result.method}, {measure}, {what}")
        for part, what in enumerate(("position", "rotation"))
    )
    return position, rotation


def _ticks(axis: LogAxis) -> list[tuple[float, float]]:
    return [(tick, 100 * axis.share(tick / 100)) for tick in axis.ticks(0.01, MOST_TICKS)]


def _rows(views: Sequence[ResultView], runs: Sequence[DrawnRun], on: Ground) -> tuple[RunRow, ...]:
    strips = {(run.method, run.file): (run, on) for run in runs}
    names = _own_names([run.file for view in views for run in view.result.runs])
    return tuple(
        RunRow(view, run, names[run.file], time_strip(*strips[view.result.method, run.file], view.style),
               run.file in view.result.diverged)
        for view in views
        for run in view.result.runs
    )  # fmt: skip


def _own_names(files: Sequence[str]) -> dict[str, str]:
    """Each file by as many of its last parts as tell it from the others."""
    for count in range(1, 6):
        short = {file: "/".join(file.split("/")[-count:]) for file in files}
        if len(set(short.values())) == len(set(files)):
            return short
    return {file: file for file in files}


def _point(view: ResultView, named: bool) -> Point | None:
    result, frames = view.result, view.result.compared_frames
    if not frames.precision_m or not frames.accuracy_m:
        return None
    name = f"{result.method}, {result.sequence}" if named else result.method
    return Point(name, frames.accuracy_m, frames.precision_m, frames is result.common, view.style)


def _notes(results: OpenLoopResults) -> list[tuple[str, list[str]]]:
    """What must be known, by what it is about."""
    notes = [(f"{result.sequence}, {result.method}", cautions(result)) for result in results.results]
    notes += [(f"Ground truth of {name}", list(said)) for name, said in results.groundtruth_notes.items()]
    notes += [(run.file, list(run.notes)) for result in results.results for run in result.runs]
    return [(about, said) for about, said in notes if said]


def _facts(settings: Settings, results: OpenLoopResults) -> list[tuple[str, str]]:
    """How it was evaluated; what is as usual is not said, but for what decides the numbers."""
    methods = {result.method: result.alignment.value for result in results.results}
    kinds = dict.fromkeys(methods.values())
    aligned = "; ".join(
        kind if len(kinds) == 1 else f"{kind}: {', '.join(who for who, own in methods.items() if own == kind)}"
        for kind in kinds
    )
    said = settings.written()
    tolerances = (1000 * settings.max_difference, 1000 * settings.frame_tolerance)
    apart = "{:g} ms from the ground truth, {:g} ms from run to run".format(*tolerances)
    facts = [
        ("Alignment", aligned + (f", by the first {settings.n_to_align} poses" if settings.n_to_align else "")),
        ("Stamps differ by at most", apart),
        ("Relative errors over", ", ".join(settings.rpe) or "nothing: --rpe 1m, --rpe 5s, --rpe 30deg, --rpe 20frames"),
    ]
    known = {"align", "n_to_align", "max_difference", "frame_tolerance", "rpe"}
    facts += [(name.replace("_", " ").capitalize(), _said(value)) for name, value in said.items() if name not in known]
    counted = [name for name, own in results.counted.items() if own]
    facts.append(("Frames", "as the study file says" if counted else "those that any run has a pose for"))
    return [*facts, ("Software", f"taskslam {__version__}")]


def _said(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _interval(over: OverRuns | None, units: Units, angle: bool = False) -> Markup:
    """The 95 % interval in the units of the page, or nothing."""
    if over is None or over.low is None or over.high is None:
        return Markup()
    shown = units.angle if angle else units.length
    return Markup('<div class="between">{}–{}</div>').format(shown(over.low), shown(over.high))
