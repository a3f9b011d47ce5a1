"""The results as Markdown tables, one for each scenario: for a README, a wiki, or the summary of a CI job."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from taskslam.evaluation.quantities import quantities
from taskslam.printable import in_markdown, one_line
from taskslam.report import cards, words
from taskslam.report.results import MethodResult, Results, pooled_results
from taskslam.report.tables.columns import COMPLETE, FAILURES, MILLISECONDS, REAL_TIME, SEEDS, Column, quantity_columns


def methods_markdown(results: Results, under_way: bool = False) -> str:
    """Each method in each mode: the best method first, its modes below one another, references last.

    under_way: more is to be driven, so a run that others have already and a method has not is no miss of its.
    """
    tables = []
    for name in results.scenarios:
        part = results.in_scenario(name)
        title = part.runs[0].manifest.title
        columns = [SEEDS, COMPLETE, *quantity_columns(), FAILURES, MILLISECONDS, REAL_TIME]
        head = ["method", "sees with", "mode", "robot", "latency", *(in_markdown(column.heading) for column in columns)]
        found = [result for method in part.methods for result in method.results]
        rows = [_cells(_by_itself(result) if under_way else result, columns) for result in found]
        lines = [_line(head), _line(["---"] * len(head)), *map(_line, rows)]
        tables.append("\n".join([f"**{in_markdown(title)}**", "", *lines]))
    return "\n\n".join([*tables, _explanation(results)]) + "\n"


def _by_itself(result: MethodResult) -> MethodResult:
    """The same without what others have driven."""
    (method,) = pooled_results(result.runs).methods
    return method.results[0]


def _cells(result: MethodResult, columns: Sequence[Column]) -> list[str]:
    return [
        _code(result.label) + (" (reference)" if result.is_reference else ""),
        in_markdown(cards.sensor_name(result.sensor)),
        words.mode(result.mode),
        _one_or_all(run.manifest.robot_name for run in result.runs),
        _one_or_all(run.manifest.latency for run in result.runs),
        *(_with_interval(in_markdown(column.text(result)), column.interval(result)) for column in columns),
    ]


def _explanation(results: Results) -> str:
    level = results.pooled[0].pooled.uncertainty.level
    over = words.intervals_over(results.several_seeds)
    said = "; ".join(f"{one.symbol}: {one.words}" for one in quantities())
    return f"{said}. Means are over waypoints reached in every round. In brackets: {level:.0%} intervals, {over}."


def _one_or_all(names: Iterable[str | None]) -> str:
    """What all runs of a row have, or the different ones."""
    known = dict.fromkeys(name for name in names if name)
    return ", ".join(map(_code, known)) or words.DASH


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _with_interval(text: str, between: str) -> str:
    return f"{text} [{between}]" if between else text


def _code(text: str) -> str:
    return f"`{one_line(text.replace('`', ' '))}`".replace("|", "\\|")
