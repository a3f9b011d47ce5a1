"""All figures of the paper from one set of results."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from matplotlib.figure import Figure

from taskslam.report import cards, palette, words
from taskslam.report.figures.bars import Bar, KeyLine, Row
from taskslam.report.figures.precision_accuracy import Panel, Point, precision_accuracy_figure, scatter_scale, tags_of
from taskslam.report.figures.scales import Quantity, Units, orientation, position
from taskslam.report.figures.style import Width
from taskslam.report.markers import Style
from taskslam.report.names import short_names
from taskslam.report.results import MethodResult, Results

_LONGEST_NAME: dict[Width, int] = {"column": 14, "page": 22}


def paper_figures(results: Results, width: Width, units: Units) -> Iterator[tuple[str, Figure]]:
    """Each figure with the name of its file, without an ending."""
    yield from _precision_accuracy(results, width, units)


def _precision_accuracy(results: Results, width: Width, units: Units) -> Iterator[tuple[str, Figure]]:
    """A figure for each mode, on scales shared between modes."""
    by_mode = {mode: _panels(results.in_mode(mode), results) for mode in results.modes}
    scales = [
        scatter_scale([point for panels in by_mode.values() for point in panels[index].points]) for index in range(2)
    ]
    for mode, panels in by_mode.items():
        ranked = results.in_mode(mode)
        rows = _completeness_rows(ranked, width)
        yield (
            f"precision_accuracy_{_slug(mode)}",
            precision_accuracy_figure(panels, rows, sensor_key(ranked), width, units, scales),
        )


def _panels(ranked: Sequence[MethodResult], results: Results) -> list[Panel]:
    return [
        Panel(position(results.diameter_m), _points(ranked, position(results.diameter_m))),
        Panel(orientation(results.field_of_view), _points(ranked, orientation(results.field_of_view))),
    ]


def _points(ranked: Sequence[MethodResult], quantity: Quantity) -> list[Point]:
    points = []
    for result, tag in zip(ranked, tags_of(len(ranked)), strict=True):
        precision, accuracy = _means(result, quantity)
        if precision is not None and accuracy is not None:
            shown = quantity.shown(accuracy), quantity.shown(precision)
            points.append(Point(result.style, result.complete, *shown, tag=tag))
    return points


def _means(result: MethodResult, quantity: Quantity) -> tuple[float | None, float | None]:
    if quantity.task == "D":
        return result.pooled.position.precision_m, result.pooled.position.accuracy_m
    return result.pooled.orientation.precision_rad, result.pooled.orientation.accuracy_rad


def _completeness_rows(ranked: Sequence[MethodResult], width: Width) -> list[Row]:
    names = short_names([result.label for result in ranked], _LONGEST_NAME[width])
    return [
        Row(
            name=f"{tag} {name}".strip(),
            style=result.style,
            filled=result.complete,
            bars=(Bar(result.pooled.completeness, words.percent(result.pooled.completeness)),),
        )
        for name, tag, result in zip(names, tags_of(len(ranked)), ranked, strict=True)
    ]


def sensor_key(ranked: Sequence[MethodResult]) -> list[KeyLine]:
    """What filling and the shapes of markers mean, as far as these methods show it."""
    sensors = {result.sensor: result for result in ranked}
    shapes: dict[int, tuple[str, Style]] = {}
    for sensor, result in sensors.items():
        shapes.setdefault(result.style.shape, (cards.sensor_name(sensor), Style(palette.MUTED, result.style.shape)))
    if any(not sensor for sensor in sensors) or len(shapes) < 2:
        return []
    return [KeyLine("hollow: incomplete", Style(palette.MUTED, 0), filled=False)] + [
        KeyLine(text, style) for text, style in shapes.values()
    ]


def _slug(text: str) -> str:
    return text.replace("-", "_")
