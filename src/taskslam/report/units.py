"""Numbers in two units at once: metric (cm, °) and the task's own (D, FoV; protocol 5.5).

The page holds both and its style sheet shows one, so that the switch needs no arithmetic and no script.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from markupsafe import Markup, escape

from taskslam.evaluation.metrics_file import Interval
from taskslam.report import words
from taskslam.report.svg import Svg
from taskslam.report.words import DASH

METRIC, TASK = "si", "tu"  # classes in the page


@dataclass(frozen=True)
class Units:
    """What a task measures in. diameter_m: D in metres, field_of_view: FoV in degrees; None: scenarios differ."""

    diameter_m: float | None
    field_of_view: float | None

    @property
    def length_unit(self) -> Markup:
        """For a heading."""
        return both("cm", None if self.diameter_m is None else "D")

    @property
    def angle_unit(self) -> Markup:
        """For a heading."""
        return both("°", None if self.field_of_view is None else "FoV")

    def length(self, metres: float | None, with_unit: bool = False) -> Markup:
        """Metres as centimetres and as D; a dash for None."""
        if metres is None:
            return escape(DASH)
        suffixes = (" cm", " D") if with_unit else ("", "")
        task = None if self.diameter_m is None else task_number(metres / self.diameter_m) + suffixes[1]
        return both(words.centimetres(metres) + suffixes[0], task)

    def interval(self, interval: Interval | None) -> Markup:
        """A 95 % interval of a length, `0.33–0.60`, without a unit; nothing for None."""
        if interval is None:
            return escape("")
        return Markup("{}–{}").format(self.length(interval.low), self.length(interval.high))

    def angle(self, radians: float | None, with_unit: bool = False) -> Markup:
        """Radians as degrees and as FoV; a dash for None."""
        if radians is None:
            return escape(DASH)
        suffixes = ("°", " FoV") if with_unit else ("", "")
        field = self.field_of_view
        task = None if field is None else task_number(math.degrees(radians) / field) + suffixes[1]
        return both(words.degrees(radians) + suffixes[0], task)


def draw_length(svg: Svg, x: float, y: float, metres: float | None, units: Units, unit: bool, **ink: object) -> None:
    """Write a length into a drawing in both units, with its unit or without; a dash for None."""
    if metres is None:
        svg.text(x, y, DASH, **ink)
        return
    svg.text(x, y, words.centimetres(metres) + " cm" * unit, class_=METRIC, **ink)
    if units.diameter_m is not None:
        svg.text(x, y, task_number(metres / units.diameter_m) + " D" * unit, class_=TASK, **ink)


def both(metric: str, task: str | None) -> Markup:
    """Two ways to say a thing, of which one shows; without a second one, plain text."""
    if task is None:
        return Markup("{}").format(metric)
    return Markup('<span class="{}">{}</span><span class="{}">{}</span>').format(METRIC, metric, TASK, task)


def task_number(value: float) -> str:
    """A number of D or FoV with the decimals that matter beside centimetres and degrees."""
    return f"{value:.4f}" if value < 0.1 else f"{value:.3f}" if value < 1 else f"{value:.2f}"
