"""Every pair of methods side by side: who is more repeatable, where the data carry it, in a matrix and in sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from taskslam.evaluation.comparison import compare_methods
from taskslam.evaluation.metrics_file import Comparison
from taskslam.report.results import MODES, Method, Results


@dataclass(frozen=True)
class Cell:
    """One method against another. ratio: of their E, below 1 where the row's is smaller; kind: better, worse, open."""

    ratio: float | None
    kind: str
    verdict: str
    key: str


@dataclass(frozen=True)
class ComparisonView:
    """All pairs in one mode. rows: each method against all; pairs: those that can be compared, the clearest first."""

    mode: str
    rows: tuple[tuple[Method, tuple[Cell, ...]], ...]
    pairs: tuple[Comparison, ...]
    uncompared: int

    @property
    def apart(self) -> int:
        """Pairs in which the data carry a difference."""
        return sum(pair.told_apart for pair in self.pairs)

    def beaten_by(self, name: str) -> list[str]:
        """Methods than which this one is more repeatable, where the data carry it."""
        return [_worse(pair) for pair in self.pairs if pair.told_apart and _better(pair) == name]


def comparison_views(results: Results) -> dict[str, ComparisonView]:
    """By mode, if at least two methods ran in it; the best method first, as in every figure.

    References compete with nobody: to compare them too would cost the methods power (Holm's correction).
    """
    methods = {method.label: method for method in results.methods if not method.is_reference}
    compared = compare_methods(
        {label: [run.metrics for result in method.results for run in result.runs] for label, method in methods.items()}
    )
    views = {}
    for mode in MODES:
        own = [pair for pair in compared if pair.mode == mode]
        names = {name for pair in own if pair.waypoints for name in (pair.a, pair.b)}
        if own:
            views[mode] = _view(mode, [method for label, method in methods.items() if label in names], own)
    return views


def _view(mode: str, methods: Sequence[Method], compared: Sequence[Comparison]) -> ComparisonView:
    pairs = [pair for pair in compared if pair.waypoints]
    by_names = {(pair.a, pair.b): pair for pair in compared}
    rows = tuple(
        (row, tuple(_cell(row.label, column.label, by_names, column.style.key) for column in methods))
        for row in methods
    )
    pairs.sort(key=lambda pair: (not pair.told_apart, pair.p_adjusted if pair.p_adjusted is not None else 2.0))
    return ComparisonView(mode, rows, tuple(pairs), len(compared) - len(pairs))


def _cell(row: str, column: str, by_names: Mapping[tuple[str, str], Comparison], key: str) -> Cell:
    pair = by_names.get((row, column)) or by_names.get((column, row))
    if pair is None or not pair.waypoints or not pair.ratio:
        return Cell(None, "none", pair.verdict if pair else "", key)
    ratio = pair.ratio if pair.a == row else 1 / pair.ratio
    kind = "open" if not pair.told_apart else "better" if ratio < 1 else "worse"
    return Cell(ratio, kind, pair.verdict, key)


def _better(pair: Comparison) -> str:
    return pair.a if pair.ratio is not None and pair.ratio < 1 else pair.b


def _worse(pair: Comparison) -> str:
    return pair.b if _better(pair) == pair.a else pair.a
