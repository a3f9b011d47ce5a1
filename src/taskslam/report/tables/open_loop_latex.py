"""Recorded trajectories as a LaTeX table: a row for each method on a sequence, which needs booktabs alone."""

from __future__ import annotations

from taskslam.report import words
from taskslam.report.tables.latex import escape
from taskslam.studies.study_results import MethodSummary, OpenLoopResults, OverRuns, Ratio


def open_loop_latex(results: OpenLoopResults) -> str:
    """Errors over the runs with 95 % intervals, and how the runs agree; the best of a sequence in bold."""
    deltas = list(dict.fromkeys(each.delta for result in results.results for each in result.rpe))
    heads = ["sequence", "method", "runs", r"ATE cm", r"rot.\ \textdegree{}"]
    heads += [f"RPE {escape(delta)} {unit}" for delta in deltas for unit in ("cm", r"\textdegree{}")]
    heads += [r"$E_\infty$ cm", "$e$ cm", r"$e/E_\infty$"]
    lines = [
        "% Needs \\usepackage{booktabs}. Root mean squares, geometric means over runs; small: their 95 \\% intervals.",
        "% E_infinity: precision, corrected for the number of runs; e: accuracy. Bold: the best of a sequence.",
        f"\\begin{{tabular}}{{ll{'r' * (len(heads) - 2)}}}",
        r"\toprule",
        " & ".join(heads) + r" \\",
    ]
    for sequence in dict.fromkeys(result.sequence for result in results.results):
        rows = [result for result in results.results if result.sequence == sequence]
        cells = [_cells(result, deltas) for result in rows]
        lines.append(r"\midrule")
        for index, (result, row) in enumerate(zip(rows, cells, strict=True)):
            shown = [_shown(cell, [other[at] for other in cells]) for at, cell in enumerate(row)]
            first = escape(sequence) if index == 0 else ""
            lines.append(" & ".join([first, escape(result.method), str(len(result.runs)), *shown]) + r" \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


Cell = tuple[str, str, bool]
"""A number, its interval, and whether the smallest of its column is the best."""


def _cells(result: MethodSummary, deltas: list[str]) -> list[Cell]:
    by_delta = {each.delta: each for each in result.rpe}
    errors: list[tuple[OverRuns | None, bool]] = [(result.ate_m, False), (result.rotation_rad, True)]
    for delta in deltas:
        found = by_delta.get(delta)
        errors += [(found.translation_m if found else None, False), (found.rotation_rad if found else None, True)]
    frames = result.compared_frames
    return [
        *(_over(over, angle) for over, angle in errors),
        (words.centimetres(frames.precision_unbiased_m), "", True),
        (words.centimetres(frames.accuracy_m), "", True),
        _ratio(result.position),
    ]


def _over(over: OverRuns | None, angle: bool) -> Cell:
    number = words.degrees if angle else words.centimetres
    if over is None:
        return words.DASH, "", True
    return number(over.value), "" if over.low is None else f"{number(over.low)}--{number(over.high)}", True


def _ratio(ratio: Ratio | None) -> Cell:
    if ratio is None:
        return words.DASH, "", False
    ends = "" if ratio.low is None or ratio.high is None else f"{words.ratio(ratio.low)}--{words.ratio(ratio.high)}"
    return words.ratio(ratio.value), ends, False


def _shown(cell: Cell, column: list[Cell]) -> str:
    text, between, less_is_better = cell
    numbers = {other[0] for other in column if other[0] != words.DASH}
    best = less_is_better and len(numbers) > 1 and text == min(numbers, key=float)
    shown = f"\\textbf{{{text}}}" if best else escape(text)
    return f"{shown} {{\\scriptsize [{escape(between)}]}}" if between else shown
