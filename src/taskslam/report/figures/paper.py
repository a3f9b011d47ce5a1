"""All figures of the paper from one set of results."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from matplotlib.figure import Figure

from taskslam.evaluation.curves import EXACT_RANGE
from taskslam.evaluation.metrics_file import Interval
from taskslam.evaluation.quantities import quantities
from taskslam.evaluation.quantities.area import EXACT
from taskslam.evaluation.quantities.success import SUCCESS, success_curve
from taskslam.evaluation.quantity import Quantity
from taskslam.mode import Mode
from taskslam.report import cards, palette, words
from taskslam.report.figures import cumulative, violins
from taskslam.report.figures.arrivals import arrivals_figure
from taskslam.report.figures.bars import DARK, LIGHT, Bar, KeyLine, Row
from taskslam.report.figures.every_quantity import Mark, QuantityPanel, quantity_figure
from taskslam.report.figures.precision_accuracy import Panel, Point, precision_accuracy_figure, scatter_scale, tags_of
from taskslam.report.figures.scales import Measure, UnitSystem, orientation, position
from taskslam.report.figures.style import Width
from taskslam.report.figures.trajectories import trajectory_figure
from taskslam.report.markers import Style
from taskslam.report.results import MODES, MethodResult, Results, Run
from taskslam.report.tables.columns import interval_of, quantity_heading, quantity_text


def paper_figures(
    results: Results, width: Width, units: UnitSystem, linear: bool = False
) -> Iterator[tuple[str, Figure]]:
    """Each figure with the name of its file, without an ending. linear: axes of errors from 0, never logarithmic."""
    yield from _precision_accuracy(results, width, units, linear)
    yield "cumulative_precision", _cumulative(results, width, units, linear)
    yield "success_within_tolerance", _success(results, width, units, linear)
    yield from _violins(results, width, units, linear)
    yield "quantities", _every_quantity(results, width)
    for run, name in zip(results.runs, _run_names(results.runs), strict=True):
        scenario = f", {run.metrics.scenario}" if len(results.scenarios) > 1 else ""
        title = f"{run.name}{scenario}{f', seed {run.metrics.seed}' if results.several_seeds else ''}"
        yield f"runs/arrivals_{name}", _arrivals(run, title, width)
        yield f"runs/trajectories_{name}", trajectory_figure(run.record, run.metrics, title, width)


def _precision_accuracy(
    results: Results, width: Width, units: UnitSystem, linear: bool
) -> Iterator[tuple[str, Figure]]:
    """A figure for each mode, on scales shared between modes."""
    by_mode = {mode: _panels(results.in_mode(mode), results) for mode in results.modes}
    scales = [
        scatter_scale([point for panels in by_mode.values() for point in panels[index].points], linear)
        for index in range(2)
    ]
    for mode, panels in by_mode.items():
        ranked = results.in_mode(mode)
        rows = _completeness_rows(ranked)
        yield (
            f"precision_accuracy_{_slug(mode)}",
            precision_accuracy_figure(panels, rows, sensor_key(ranked), width, units, scales),
        )


def _panels(ranked: Sequence[MethodResult], results: Results) -> list[Panel]:
    return [
        Panel(position(results.units.diameter_m), _points(ranked, position(results.units.diameter_m))),
        Panel(orientation(results.units.field_of_view), _points(ranked, orientation(results.units.field_of_view))),
    ]


def _points(ranked: Sequence[MethodResult], quantity: Measure) -> list[Point]:
    points = []
    for result, tag in zip(ranked, tags_of(len(ranked)), strict=True):
        precision, accuracy = _means(result, quantity)
        if precision is None or accuracy is None:  # no waypoint was reached in two rounds or more
            continue
        of_accuracy, of_precision = _intervals(result, quantity)
        points.append(
            Point(
                result.style,
                result.complete,
                quantity.shown(accuracy),
                quantity.shown(precision),
                _shown(of_accuracy, quantity),
                _shown(of_precision, quantity),
                tag,
            )
        )
    return points


def _means(result: MethodResult, quantity: Measure) -> tuple[float | None, float | None]:
    if quantity.task == "D":
        return result.pooled.position.precision_m, result.pooled.position.accuracy_m
    return result.pooled.orientation.precision_rad, result.pooled.orientation.accuracy_rad


def _cumulative(results: Results, width: Width, units: UnitSystem, linear: bool) -> Figure:
    curves = {
        (result.label, result.mode): (result.pooled.precisions_m, result.pooled.planned_waypoints)
        for result in results.pooled
        if result.pooled.area.exact is not None
    }
    reach = f"0–{position(None).shown(EXACT_RANGE):g} cm"
    return _steps(
        results, curves, EXACT, f"{EXACT.symbol}, {reach}", "exact integral", cumulative.WAYPOINTS, width, units, linear
    )


def _success(results: Results, width: Width, units: UnitSystem, linear: bool) -> Figure:
    found = {
        (result.label, result.mode): success_curve([run.metrics for run in result.runs], result.missing)
        for result in results.pooled
    }
    curves = {key: curve for key, curve in found.items() if curve is not None}
    labels = cumulative.Labels("tolerance about the mean", "arrivals within (%)")
    return _steps(results, curves, SUCCESS, f"{SUCCESS.symbol} (%)", "within 2 cm and 2°", labels, width, units, linear)


def _steps(
    results: Results,
    curves: Mapping[tuple[str, str], tuple[tuple[float, ...], int]],
    of: Quantity,
    heading: str,
    what: str,
    labels: cumulative.Labels,
    width: Width,
    units: UnitSystem,
    linear: bool,
) -> Figure:
    """Step curves of methods by mode, and beside them the quantity that they amount to. curves: values and planned."""
    methods = results.methods
    tags = {method.label: tag for method, tag in zip(methods, tags_of(len(methods)), strict=True)}
    rows = [
        Row(
            tag=tags[method.label],
            name=method.label,
            style=method.style,
            filled=method.complete,
            bars=tuple(
                Bar(
                    result.quantities[of.key].value,
                    quantity_text(of, result.quantities[of.key].value),
                    _share(interval_of(result, of)),
                    DARK if result.mode == Mode.WITH_MAP else LIGHT,
                )
                for result in method.results
            ),
        )
        for method in methods
    ]
    axis = position(results.units.diameter_m)
    panels = [
        cumulative.Panel(
            words.mode(mode),
            [
                cumulative.Curve(
                    result.style,
                    result.complete,
                    tuple(axis.shown(value) for value in curves[result.label, mode][0]),
                    curves[result.label, mode][1],
                    tags[result.label],
                )
                for result in results.pooled
                if result.mode == mode and (result.label, mode) in curves
            ],
        )
        for mode in results.modes
    ]
    key = [KeyLine(f"{of.symbol}: {what}")]
    key += [
        KeyLine(f"{shade}: {words.mode(mode)}")
        for mode, shade in zip(MODES, ("light", "full"), strict=True)
        if mode in results.modes
    ]
    limit = axis.size or axis.shown(EXACT_RANGE) / 4
    return cumulative.cumulative_figure(
        panels, rows, [*key, *sensor_key([method.results[0] for method in methods])], heading, axis, limit, width,
        units, labels, linear,
    )  # fmt: skip


def _every_quantity(results: Results, width: Width) -> Figure:
    methods = results.methods
    panels = []
    for of in quantities():
        factor = of.dimension.value.factor
        marks = []
        for method in methods:
            found = [(result.mode, result.quantities[of.key]) for result in method.results]
            marks.append(
                [
                    Mark(factor * one.value, _times(factor, one.low), _times(factor, one.high), mode == Mode.WITH_MAP)
                    for mode, one in found
                    if one.value is not None
                ]
            )
        panels.append(QuantityPanel(quantity_heading(of), marks))
    modes = [words.mode(mode) for mode in results.modes]
    return quantity_figure([m.label for m in methods], [m.style for m in methods], panels, modes, width)


def _times(factor: float, value: float | None) -> float | None:
    return None if value is None else factor * value


def _violins(results: Results, width: Width, units: UnitSystem, linear: bool) -> Iterator[tuple[str, Figure]]:
    quantity = position(results.units.diameter_m)
    for what, letter in (("precision", quantity.precision), ("accuracy", quantity.accuracy)):
        rows = [
            violins.ViolinRow(
                method.label,
                method.style,
                method.complete,
                method.completeness_label,
                _samples(method.without_map, what, quantity),
                _samples(method.with_map, what, quantity),
            )
            for method in results.methods
        ]
        words_of = f"{what} {letter}"
        yield f"violins_{what}", violins.violin_figure(rows, quantity, units, words_of, width, results.modes, linear)


def _samples(result: MethodResult | None, what: str, quantity: Measure) -> tuple[float, ...]:
    if result is None:
        return ()
    values = result.pooled.precisions_m if what == "precision" else result.pooled.accuracies_m
    return tuple(quantity.shown(value) for value in values)


def _arrivals(run: Run, title: str, width: Width) -> Figure:
    rounds = [summary.round for summary in run.metrics.round_summaries if not summary.priming]
    tolerance = run.manifest.goal_tolerance
    return arrivals_figure(run.metrics.waypoints, rounds, tolerance, run.style.colour, title, width)


def _run_names(runs: Sequence[Run]) -> list[str]:
    """A name for the files of each run, of letters that every file system takes; no two are alike."""
    seeds = {run.metrics.seed for run in runs}
    names: list[str] = []
    for run in runs:
        parts = [
            run.metrics.scenario,
            run.label,
            run.mode,
            *([f"seed{run.metrics.seed}"] if len(seeds) > 1 else []),
        ]
        name = _slug("_".join(parts))
        number = sum(other == name or other.startswith(f"{name}_run") for other in names)
        names.append(f"{name}_run{number + 1}" if number else name)
    return names


def _intervals(result: MethodResult, quantity: Measure) -> tuple[Interval | None, Interval | None]:
    """Of accuracy and of precision."""
    sure = result.pooled.uncertainty
    if quantity.task == "D":
        return sure.accuracy_m, sure.precision_m
    return sure.accuracy_rad, sure.precision_rad


def _shown(interval: Interval | None, quantity: Measure) -> tuple[float, float] | None:
    return None if interval is None else (quantity.shown(interval.low), quantity.shown(interval.high))


def _share(interval: Interval | None) -> tuple[float, float] | None:
    return None if interval is None else (interval.low, interval.high)


def _completeness_rows(ranked: Sequence[MethodResult]) -> list[Row]:
    return [
        Row(
            tag=tag,
            name=result.label,
            style=result.style,
            filled=result.complete,
            bars=(
                Bar(
                    result.pooled.completeness,
                    words.percent(result.pooled.completeness),
                    _share(result.pooled.uncertainty.completeness),
                ),
            ),
        )
        for tag, result in zip(tags_of(len(ranked)), ranked, strict=True)
    ]


def sensor_key(ranked: Sequence[MethodResult]) -> list[KeyLine]:
    """What filling and the shapes of markers mean, as far as these methods show it."""
    shapes: dict[int, set[str]] = {}
    for result in ranked:
        shapes.setdefault(result.style.shape, set()).add(result.sensor)
    over = words.seeds([seed for result in ranked for seed in result.pooled.seeds])
    lines = [KeyLine("whisker: 95 % interval"), KeyLine(f"of {over}")]
    lines += [KeyLine("hollow: incomplete", Style(palette.MUTED, 0), filled=False)]
    if all(map(all, shapes.values())) and len(shapes) > 1:
        named = sorted((", ".join(sorted(map(cards.sensor_name, sensors))), shape) for shape, sensors in shapes.items())
        lines += [KeyLine(name, Style(palette.MUTED, shape)) for name, shape in named]
    return lines


def _slug(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_").lower()[:80]
