"""The results as Markdown tables, one for each scenario: for a README, a wiki, or the summary of a CI job."""

from __future__ import annotations

from collections.abc import Sequence

from taskslam.report import cards, words
from taskslam.report.results import MethodResult, Results

_HEAD = ("method", "sees with", "mode", "complete", "E, cm", "e, cm", "N-AUC", "failures", "ms a frame", "× real time")


def methods_markdown(results: Results) -> str:
    """Each method in each mode: the best method first, its modes below one another, references last."""
    tables = []
    for name in results.scenarios:
        part = results.in_scenario(name)
        title = part.runs[0].manifest.title
        rows = [_cells(result) for method in part.methods for result in method.results]
        lines = [_line(_HEAD), _line(["---"] * len(_HEAD)), *map(_line, rows)]
        tables.append("\n".join([f"**{_escaped(title)}**", "", *lines]))
    return "\n\n".join([*tables, _explanation(results)]) + "\n"


def _cells(result: MethodResult) -> list[str]:
    pooled, sure = result.pooled, result.pooled.uncertainty
    interval = sure.precision_here_m
    between = "" if interval is None else f" [{words.centimetres(interval.low)}, {words.centimetres(interval.high)}]"
    return [
        f"`{result.label.replace('`', ' ')}`" + (" (reference)" if result.is_reference else ""),
        cards.sensor_name(result.sensor),
        words.mode(result.mode),
        f"{pooled.complete_waypoints}/{pooled.planned_waypoints}",
        words.centimetres(pooled.position.precision_m) + between,
        words.centimetres(pooled.position.accuracy_m),
        words.plain(pooled.n_auc.exact, 3),
        words.outcomes(pooled.failures_by_kind) or words.DASH,
        words.plain(_milliseconds(result), 1),
        words.plain(pooled.real_time_factor, 1),
    ]


def _milliseconds(result: MethodResult) -> float | None:
    """The method's own processor time for a frame that it was handed, ms; None without frames."""
    handed = result.pooled.frames - result.pooled.dropped_frames
    spent = sum(run.metrics.compute_s for run in result.runs)
    return 1e3 * spent / handed if handed > 0 else None


def _explanation(results: Results) -> str:
    level = results.pooled[0].pooled.uncertainty.level
    return (
        f"complete: waypoints reached in every round. E: mean distance of a waypoint's arrivals to their mean, with its"
        f" {level:.0%} interval for other rounds at these waypoints; e: to the goal; both over complete waypoints."
    )


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(_escaped(cell) for cell in cells)} |"


def _escaped(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
