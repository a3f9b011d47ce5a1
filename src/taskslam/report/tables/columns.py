"""The columns of every table of results, described once; screen, page, LaTeX and Markdown render each its own way.

A column of a quantity comes from the list of quantities; the few others say what a run took and how it failed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from markupsafe import Markup, escape

from taskslam.errors import InputError, did_you_mean
from taskslam.evaluation.metrics_file import Interval, Measured, Row, RunMetrics
from taskslam.evaluation.pooled import Pooled
from taskslam.evaluation.quantities import quantities
from taskslam.evaluation.quantity import Dimension, Quantity
from taskslam.report import words
from taskslam.report.units import Units


class Entry(Protocol):
    """A row: a method in one mode over all its runs, or one run."""

    @property
    def quantities(self) -> Mapping[str, Measured]:
        """Every quantity by its key."""

    @property
    def numbers(self) -> RunMetrics | Pooled | Row:
        """What it took and how it failed."""


@dataclass(frozen=True)
class Column:
    """A column. heading: with the unit after a comma; latex: the same for a paper; text: of a row.

    interval: the ends of the 95 % interval, empty where there is none. quantity: what is shown, None of other columns.
    is_words: whether it holds words and not numbers.
    """

    heading: str
    text: Callable[[Entry], str]
    latex: str = ""
    interval: Callable[[Entry], str] = lambda _: ""
    quantity: Quantity | None = None
    is_words: bool = False

    def html_heading(self, units: Units) -> Markup:
        """For the page, with both units."""
        name, comma, unit = self.heading.partition(", ")
        if self.quantity is not None and self.quantity.dimension is Dimension.LENGTH:
            return Markup("{}<br>{}").format(name, units.length_unit)
        if self.quantity is not None and self.quantity.dimension is Dimension.ANGLE:
            return Markup("{}<br>{}").format(name, units.angle_unit)
        return Markup("{}<br>{}").format(name, unit) if comma else escape(name)

    def html(self, row: Entry, units: Units) -> Markup:
        """A cell of the page, with both units, and below it the interval."""
        if self.quantity is None:
            return escape(self.text(row))
        of = _of(self.quantity, row)
        shown = _both(self.quantity, of.value, units)
        if of.low is None or of.high is None:
            return shown
        ends = Markup("{}–{}").format(_both(self.quantity, of.low, units), _both(self.quantity, of.high, units))
        return Markup('{}<div class="between">{}</div>').format(shown, ends)


def quantity_columns(essential: bool = False) -> list[Column]:
    """A column for every quantity; only those for narrow places if `essential`. Raises InputError for a broken one."""
    return [_column(one) for one in quantities() if one.essential or not essential]


def columns_named(names: Sequence[str]) -> list[Column]:
    """The columns of these symbols, such as `E`, `C`, `N-AUC`, or headings. Raises InputError for another."""
    named = {column.quantity.symbol: column for column in quantity_columns() if column.quantity is not None}
    named |= {column.latex or column.heading: column for column in _OTHERS}
    for name in names:
        if name not in named:
            raise InputError(f"column {name}: expected some of {', '.join(named)}.{did_you_mean(name, named)}")
    return [named[name] for name in names]


def quantity_text(quantity: Quantity, value: float | None) -> str:
    """A value as people write it, without its unit."""
    if value is None:
        return words.DASH
    if quantity.dimension is Dimension.LENGTH:
        return words.centimetres(value)
    if quantity.dimension is Dimension.ANGLE:
        return words.degrees(value)
    return words.percent(value) if quantity.dimension is Dimension.SHARE else words.plain(value, quantity.digits)


def quantity_heading(quantity: Quantity) -> str:
    """Symbol and unit: `E, cm`."""
    unit = quantity.dimension.value.unit.replace("deg", "°")
    return f"{quantity.symbol}, {unit}" if unit else quantity.symbol


def _column(quantity: Quantity) -> Column:
    def interval(row: Entry) -> str:
        of = _of(quantity, row)
        if of.low is None or of.high is None:
            return ""
        return f"{quantity_text(quantity, of.low)}, {quantity_text(quantity, of.high)}"

    unit = {"cm": "(cm)", "deg": r"($^\circ$)", "%": r"(\%)", "": ""}[quantity.dimension.value.unit]
    return Column(
        heading=quantity_heading(quantity),
        text=lambda row: quantity_text(quantity, _of(quantity, row).value),
        latex=f"{quantity.latex} {unit}".strip() if quantity.latex else "",
        interval=interval,
        quantity=quantity,
    )


def _of(quantity: Quantity, row: Entry) -> Measured:
    return row.quantities.get(quantity.key, Measured(value=None))


def _both(quantity: Quantity, value: float | None, units: Units) -> Markup:
    if quantity.dimension is Dimension.LENGTH:
        return units.length(value)
    if quantity.dimension is Dimension.ANGLE:
        return units.angle(value)
    return escape(quantity_text(quantity, value))


def interval_of(row: Entry, quantity: Quantity) -> Interval | None:
    """The interval of a quantity in a row."""
    of = _of(quantity, row)
    return None if of.low is None or of.high is None else Interval(low=of.low, high=of.high)


def _milliseconds(row: Entry) -> str:
    """The method's own processor time for a frame that it was handed."""
    handed = row.numbers.frames - row.numbers.dropped_frames
    return words.plain(1e3 * row.numbers.compute_s / handed if handed > 0 else None, 1)


def _dropped(row: Entry) -> str:
    return f"{row.numbers.dropped_frames} of {row.numbers.frames}"


SEEDS = Column("seeds", lambda row: words.seeds(row.numbers.seeds), is_words=True)
COMPLETE = Column("complete", lambda row: f"{row.numbers.complete_waypoints}/{row.numbers.planned_waypoints}")
FAILURES = Column("failures", lambda row: words.outcomes(row.numbers.failures_by_kind) or words.DASH, is_words=True)
MILLISECONDS = Column("ms a frame", _milliseconds)
REAL_TIME = Column("× real time", lambda row: words.plain(row.numbers.real_time_factor, 1), latex="RTF")
DROPPED = Column("dropped frames", _dropped)
_OTHERS = (SEEDS, COMPLETE, FAILURES, MILLISECONDS, REAL_TIME, DROPPED)
