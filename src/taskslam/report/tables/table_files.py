"""All tables of results in files: LaTeX for a paper, Markdown for a page, CSV for further work.

CSV files hold one thing a row, in metres, radians and shares, unrounded; what is not defined is empty.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

from taskslam.errors import RecordError
from taskslam.evaluation.quantities import quantities
from taskslam.files import write_whole, writing
from taskslam.printable import printable
from taskslam.report.results import Results
from taskslam.report.tables.columns import quantity_columns
from taskslam.report.tables.latex import ANY, document, methods_latex, waypoints_latex
from taskslam.report.tables.layout import Layout
from taskslam.report.tables.markdown import methods_markdown


def write_tables(results: Results, folder: Path, layout: Layout = ANY) -> list[Path]:
    """Write every table into a folder, which is made; returns the paths. layout: of those in LaTeX.

    Raises RecordError if no run was finished and whole, DiskFullError.
    """
    if not results.runs:
        raise RecordError("none of the runs can be used; expected at least one that is finished and whole")
    snippets = {"methods.tex": methods_latex(results, layout)}
    for number, scenario in enumerate(results.scenarios, start=1):
        name = f"waypoints_{number}.tex" if len(results.scenarios) > 1 else "waypoints.tex"
        snippets[name] = waypoints_latex(results, scenario, layout)
    files = {
        **snippets,
        "tables.tex": document(snippets, layout),
        "methods.md": methods_markdown(results),
        "methods.csv": methods_csv(results),
        "waypoints.csv": waypoints_csv(results),
        "failures.csv": failures_csv(results),
    }
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        write_whole(folder / name, text)
    return [folder / name for name in files]


def methods_csv(results: Results) -> str:
    """One row for each method in each mode."""
    kinds = sorted({kind for result in results.pooled for kind in result.pooled.failures_by_kind})
    columns = [column.quantity for column in quantity_columns() if column.quantity is not None]
    head = [
        "method", "mode", "sensor", "reference", "seeds", "runs", "missing_runs",
        "complete_waypoints", "planned_waypoints",
        *(name for of in columns for name in (of.column, f"{of.column}_low95", f"{of.column}_high95")),
        "precision_unbiased_m", *(f"failures_{kind}" for kind in kinds), "frames", "dropped_frames", "compute_s",
        "real_time_factor",
    ]  # fmt: skip
    rows = []
    for mode in results.modes:
        for result in results.in_mode(mode):
            pooled = result.pooled
            found = [result.quantities[of.key] for of in columns]
            rows.append(
                [
                    result.label, mode, result.sensor, result.is_reference, len(pooled.seeds), pooled.runs,
                    pooled.missing_runs,
                    pooled.complete_waypoints, pooled.planned_waypoints,
                    *(number for of in found for number in (of.value, of.low, of.high)),
                    pooled.uncertainty.precision_unbiased_m,
                    *(pooled.failures_by_kind.get(kind, 0) for kind in kinds),
                    pooled.frames, pooled.dropped_frames, pooled.compute_s, pooled.real_time_factor,
                ]
            )  # fmt: skip
    return _csv(head, rows)


def waypoints_csv(results: Results) -> str:
    """One row for each waypoint of each run. waypoint counts from 1, as on figures."""
    columns = [one for one in quantities() if one.of_waypoint is not None]
    head = [
        "scenario", "method", "mode", "seed", "waypoint", "x_m", "y_m", "theta_rad", "visits", "rounds", "complete",
        *(of.column for of in columns), "precision_rms_m", "control_m", "estimation_m",
    ]  # fmt: skip
    rows = [
        [
            run.metrics.scenario, run.label, run.metrics.mode, run.metrics.seed, at.goal + 1, *at.target, at.visits,
            at.rounds, at.complete, *(at.quantities.get(of.key) for of in columns), at.precision_rms_m,
            at.control.position_m, at.estimation.position_m,
        ]
        for run in results.runs
        for at in run.metrics.waypoints
    ]  # fmt: skip
    return _csv(head, rows)


def failures_csv(results: Results) -> str:
    """One row for each goal that was not reached, priming rounds included."""
    head = [
        "scenario", "method", "mode", "seed", "round", "waypoint", "outcome", "blames", "t_s", "x_m", "y_m", "detail",
    ]  # fmt: skip
    rows = [
        [
            run.metrics.scenario, run.label, run.metrics.mode, run.metrics.seed,
            run.metrics.round_name(failure.round), failure.goal + 1, failure.outcome, failure.blames, failure.t_s,
            *(failure.truth[:2] if failure.truth else (None, None)), failure.detail,
        ]
        for run in results.runs
        for failure in run.metrics.failures
    ]  # fmt: skip
    return _csv(head, rows)


def _csv(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Comma-separated lines; floats by repr, so they come back bit for bit."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([printable(cell) if isinstance(cell, str) else cell for cell in row] for row in rows)
    return buffer.getvalue()
