"""Precision against accuracy of repeated open-loop runs, as the paper draws its EuRoC study (protocol 5.5, 5.8).

One marker is one method on one sequence, tagged with the sequence.
"""

from __future__ import annotations

import statistics
from dataclasses import replace

from matplotlib.figure import Figure

from taskslam.report.figures.bars import Bar, KeyLine, Row
from taskslam.report.figures.precision_accuracy import Panel, Point, precision_accuracy_figure
from taskslam.report.figures.scales import Measure, orientation, position
from taskslam.report.figures.style import Width
from taskslam.report.markers import Style, method_styles
from taskslam.studies.study_results import MethodSummary, OpenLoopResults


def open_loop_figure(results: OpenLoopResults, width: Width) -> Figure:
    """Both panels, a row for each method with its mean completeness, and what a hollow marker means."""
    styles = method_styles([result.method for result in results.results])
    drawn = [result for result in results.results if result.compared_frames.precision_m is not None]
    degrees = orientation(results.units.field_of_view)
    steps = (results.units.field_of_view / step for step in (10, 5, 2, 1, 0.5, 0.2, 0.1))
    degrees = replace(degrees, parts=(1, 2, *(round(parts) for parts in steps)))  # whole degrees (protocol 5.5)
    panels = [
        Panel(quantity, [_point(result, styles[result.method], quantity) for result in drawn])
        for quantity in (position(results.units.robot_diameter), degrees)
    ]
    rows = [_row(method, style, results) for method, style in styles.items()]
    some = next(iter(styles.values()))
    key = [KeyLine("frames of all runs", some, True), KeyLine("frames of some runs", some, False)]
    hollow = any(not _filled(result) for result in drawn)
    return precision_accuracy_figure(panels, rows, key if hollow else [], width, "metric")


def _filled(result: MethodSummary) -> bool:
    return result.compared_frames is result.common


def _point(result: MethodSummary, style: Style, quantity: Measure) -> Point:
    """E as the paper has it; on frames of some runs corrected for how many these are, or they would look too good."""
    frames = result.compared_frames
    in_cm = quantity.unit == "cm"
    accuracy = frames.accuracy_m if in_cm else frames.accuracy_rad
    precision = frames.precision_m if in_cm else frames.precision_rad
    correction = 1.0 if _filled(result) else (frames.precision_unbiased_m or 0.0) / (frames.precision_m or 1.0)
    return Point(
        style,
        _filled(result),
        quantity.shown(accuracy or 0.0),
        quantity.shown(correction * (precision or 0.0)),
        tag=result.sequence,
    )


def _row(method: str, style: Style, results: OpenLoopResults) -> Row:
    own = [result for result in results.results if result.method == method]
    completeness = statistics.fmean(run.completeness for result in own for run in result.runs)
    value = min(completeness, 1.0)
    return Row(method, style, all(_filled(result) for result in own), (Bar(value, f"{100 * value:.0f}"),))
