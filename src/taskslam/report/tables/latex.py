"""Tables for a paper: `tabular` snippets that need booktabs alone. Any text is escaped."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from taskslam.evaluation.metrics_file import WaypointMetrics
from taskslam.evaluation.quantities import quantities
from taskslam.report import words
from taskslam.report.results import MethodResult, Results, Run
from taskslam.report.tables.columns import FAILURES, REAL_TIME, Column, quantity_text
from taskslam.report.tables.layout import Layout

ANY = Layout()

_ESCAPES = str.maketrans(
    {
        "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
        "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
        "|": r"\textbar{}", '"': r"\textquotedbl{}", "–": "--",
        "Δ": r"$\Delta$", "δ": r"$\delta$", "₁": "$_1$", "₅": "$_5$", "…": r"\dots{}", "°": r"\textdegree{}",
    }
)  # fmt: skip
_DOCUMENT = r"""\documentclass{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\usepackage{textcomp}
\usepackage{booktabs}
\usepackage[PAGE]{geometry}
\begin{document}
\pagestyle{empty}\footnotesize\setlength{\tabcolsep}{4pt}
%s
\end{document}
"""


def escape(text: str) -> str:
    """Any text as LaTeX that prints it; line breaks and other control characters become blanks."""
    return "".join(letter if letter.isprintable() else " " for letter in text).translate(_ESCAPES)


def document(names: Iterable[str], layout: Layout = ANY) -> str:
    """A document that shows the snippets of these files; it compiles as it stands beside them."""
    page = f"paper=letterpaper,textwidth={layout.width}in" if layout.width else "a4paper,landscape,margin=12mm"
    return _DOCUMENT.replace("PAGE", page) % "\n\n\\bigskip\n\n".join(f"\\noindent\\input{{{name}}}" for name in names)


def methods_latex(results: Results, layout: Layout = ANY) -> str:
    """Methods by metrics, mode by mode: the most complete first, the best of each column in bold."""
    columns = layout.of_methods
    head = ["method", *(column.latex or escape(column.heading) for column in columns)]
    kinds = "".join("l" if column.is_words else "r" for column in columns)
    lines = [_explanation(results, layout), *_begin(layout, f"l{kinds}"), _row(head)]
    for mode in results.modes:
        ranked = results.in_mode(mode)
        best = [_best(column, ranked) for column in columns]
        lines += _mode_lines(mode, len(head))
        lines += [_method_row(result, columns, best, layout) for result in ranked]
    return "\n".join([*lines, *_end(layout), ""])


def waypoints_latex(results: Results, scenario: str, layout: Layout = ANY) -> str:
    """E in cm and, in parentheses, Delta in degrees, for every run of a scenario and each of its waypoints.

    As the table that the paper's authors published: a dash where a round missed the waypoint, the best E in bold, and
    the mean over complete waypoints underlined where some are not.
    """
    runs = [run for run in results.runs if run.metrics.scenario == scenario]
    count = max(len(run.metrics.waypoints) for run in runs)
    most = layout.waypoints
    blocks = []
    for first in range(0, count, most):
        goals = range(first, min(first + most, count))
        blocks.append(_waypoint_block(results, scenario, goals, goals[-1] == count - 1, layout))
    head = f"% {escape(scenario)}: E in cm (Delta in degrees) at each waypoint; underlined: mean over some of them."
    return "\n".join([head, "\n\n\\medskip\n\n".join(blocks), ""])


def _begin(layout: Layout, columns: str) -> list[str]:
    """The lines that open a table; one that must fit has smaller letters and gaps."""
    fitted = ["{\\footnotesize\\setlength{\\tabcolsep}{3pt}%"] if layout.width else []
    edge = "@{}" if layout.width else ""
    return [*fitted, f"\\begin{{tabular}}{{{edge}{columns}{edge}}}", r"\toprule"]


def _end(layout: Layout) -> list[str]:
    return [r"\bottomrule", r"\end{tabular}" + ("}" if layout.width else "")]


def _mode_lines(mode: str, across: int) -> list[str]:
    return [r"\midrule", f"\\multicolumn{{{across}}}{{l}}{{\\emph{{{escape(words.mode(mode))}}}}} \\\\"]


def _best(column: Column, ranked: Sequence[MethodResult]) -> frozenset[str]:
    """Labels of the methods that read as the best one does; none where all read alike."""
    of = column.quantity
    if of is None:
        return frozenset()
    values = {
        result.label: value
        for result in ranked
        if not result.is_reference and (value := result.quantities[of.key].value) is not None
    }
    top = max((result.pooled.completeness for result in ranked if result.label in values), default=0.0)
    least = {result.label for result in ranked if result.pooled.completeness < top} if of.fair else set[str]()
    competing = {label: value for label, value in values.items() if label not in least}
    if len({quantity_text(of, value) for value in competing.values()}) < 2:
        return frozenset()
    text = quantity_text(of, of.best_of(competing.values()))
    return frozenset(label for label, value in competing.items() if quantity_text(of, value) == text)


def _cell(column: Column, result: MethodResult, best: frozenset[str], layout: Layout) -> str:
    """The value, bold among the best, and its interval if there is room for it."""
    if column is FAILURES:
        return escape(words.outcomes(result.pooled.failures_by_kind) or "none")
    shown = escape(column.text(result))
    shown = f"\\textbf{{{shown}}}" if result.label in best else shown
    between = column.interval(result) if _has_interval(column, layout) else ""
    return f"{shown} {{\\scriptsize [{escape(between)}]}}" if between else shown


def _has_interval(column: Column, layout: Layout) -> bool:
    return layout.intervals and column.quantity is not None and column.quantity.essential


def _method_row(result: MethodResult, columns: Sequence[Column], best: Sequence[frozenset[str]], layout: Layout) -> str:
    pooled = result.pooled
    name = f"\\emph{{{escape(result.label)}}}" if result.is_reference else escape(result.label)
    if pooled.missing_runs:
        name += f" ({pooled.runs} of {pooled.planned_runs} runs)"
    cells = [_cell(column, result, labels, layout) for column, labels in zip(columns, best, strict=True)]
    return _row([name, *cells])


def _waypoint_block(results: Results, scenario: str, goals: range, with_mean: bool, layout: Layout) -> str:
    named = [] if layout.width else ["mode"]
    head = [*named, "method", *(str(goal + 1) for goal in goals), *(["mean"] if with_mean else [])]
    words_of = len(named) + 1
    lines = [*_begin(layout, "l" * words_of + "r" * (len(head) - words_of)), _row(head)]
    for mode in results.modes:
        ranked = [
            (run, result.is_reference)
            for result in results.in_mode(mode)
            for run in result.runs
            if run.metrics.scenario == scenario
        ]
        if not ranked:
            continue
        lines += [r"\midrule"] if named else _mode_lines(mode, len(head))
        best = {
            goal: _least(_precision(_at(run, goal)) for run, reference in ranked if not reference) for goal in goals
        }
        seeds = len({run.metrics.seed for run, _ in ranked}) > 1
        for index, (run, reference) in enumerate(ranked):
            name = f"{run.label}, seed {run.metrics.seed}" if seeds else run.label
            cells = [_waypoint_cell(_at(run, goal), None if reference else best[goal]) for goal in goals]
            mean = [_mean_cell(run)] if with_mean else []
            own_mode = [words.mode(mode) if index == 0 else ""] if named else []
            lines.append(_row([*own_mode, escape(name), *cells, *mean]))
    return "\n".join([*lines, *_end(layout)])


def _at(run: Run, goal: int) -> WaypointMetrics | None:
    return next((waypoint for waypoint in run.metrics.waypoints if waypoint.goal == goal), None)


def _precision(waypoint: WaypointMetrics | None) -> float | None:
    """E of a complete waypoint."""
    return waypoint.position.precision_m if waypoint is not None and waypoint.complete else None


def _waypoint_cell(waypoint: WaypointMetrics | None, best: float | None) -> str:
    precision = _precision(waypoint)
    if waypoint is None or precision is None:
        return "--"
    text = words.centimetres(precision)
    text = f"\\textbf{{{text}}}" if best is not None and text == words.centimetres(best) else text
    return f"{text} ({escape(words.degrees(waypoint.orientation.precision_rad))})"


def _mean_cell(run: Run) -> str:
    metrics = run.metrics
    if metrics.position.precision_m is None:
        return "--"
    degrees = escape(words.degrees(metrics.orientation.precision_rad))
    text = f"{words.centimetres(metrics.position.precision_m)} ({degrees})"
    return text if metrics.complete_waypoints == metrics.planned_waypoints else f"\\underline{{{text}}}"


def _explanation(results: Results, layout: Layout) -> str:
    rounds = ", ".join(map(str, results.rounds))
    level = results.pooled[0].pooled.uncertainty.level
    over = words.intervals_over(results.several_seeds)
    shown = {column.quantity.key for column in layout.of_methods if column.quantity is not None}
    return "\n".join(
        (
            f"% Needs \\usepackage{{booktabs}}. Scenarios: {escape(', '.join(results.scenarios))}; rounds: {rounds}.",
            *(f"% {one.latex or escape(one.symbol)}: {escape(one.words)}." for one in quantities() if one.key in shown),
            "% Means are over waypoints reached in every round.",
            *([f"% In brackets: {100 * level:g} \\% intervals, {over}."] if layout.intervals else []),
            "% Bold: the best, of a mean among the most complete methods. Italic: a reference, told the truth.",
            *(["% RTF: simulated time over wall time."] if REAL_TIME in layout.of_methods else []),
        )
    )


def _row(cells: Iterable[str]) -> str:
    return " & ".join(cells) + r" \\"


def _least(values: Iterable[float | None]) -> float | None:
    return min((value for value in values if value is not None and math.isfinite(value)), default=None)
