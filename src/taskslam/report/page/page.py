"""One self-contained page: verdict first, then the pictures and tables that support it, then what was run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from taskslam.errors import RecordError
from taskslam.evaluation.quantities.area import EXACT
from taskslam.evaluation.quantities.published import COMPLETENESS
from taskslam.evaluation.quantities.success import SUCCESS
from taskslam.files import write_whole, writing
from taskslam.mode import Mode
from taskslam.printable import printable
from taskslam.report import cards
from taskslam.report.markers import marker_shapes
from taskslam.report.page.comparison_view import comparison_views
from taskslam.report.page.failure_story import WINDOW_S
from taskslam.report.page.page_data import page_data
from taskslam.report.page.plan_drawing import plan_pictures
from taskslam.report.page.replay import MOST_OF_A_PAGE, kept_on_page
from taskslam.report.page.setting import facts, rounds_of
from taskslam.report.page.shell import Entry, render
from taskslam.report.page.suite import SuiteView, is_suite, suite_view
from taskslam.report.page.verdicts import mode_verdicts, run_verdict, split
from taskslam.report.page.views import RunView, ScenarioView, run_view, scenario_view
from taskslam.report.results import Results, read_results
from taskslam.report.tables.columns import quantity_columns, quantity_text

_REPLAY = ("replay.css", "tour_drawing.js", "replay.js")
MOST_OPEN_RUNS = 4  # with more runs than these, what belongs to a single run is folded away


def write_report(folders: Sequence[Path], out: Path) -> Path:
    """Write the page about all finished runs at or below the given folders; returns its path.

    With several scenarios or more than two methods it opens with an overview of all of them (`suite.py`). Runs and
    trajectories that cannot be read are named on the page and left out. Raises RecordError if there is no finished run,
    DiskFullError if the page cannot be written.
    """
    results = read_results(folders)
    if not results.runs:
        first = results.left_out[0]
        more = f", nor can {len(results.left_out) - 1} others" if len(results.left_out) > 1 else ""
        raise RecordError(f"no finished run to report on: {first.directory} cannot be used{more}: {first.reason}")
    runs = [run_view(f"run-{index}", run) for index, run in enumerate(results.runs, start=1)]
    kept = dict(zip((run.anchor for run in runs), kept_on_page([run.replay for run in runs]), strict=True))
    whole_suite = is_suite(results)
    scenarios = [
        scenario_view([run for run in runs if run.metrics.scenario == name], whole_suite) for name in results.scenarios
    ]
    suite = suite_view(results, scenarios) if whole_suite else None
    text = render(
        "report.html",
        [Entry(run.label, run.style) for run in results.first_runs],
        results.modes,
        _parts(suite, scenarios),
        more=_REPLAY,
        replays=kept,
        replays_left_out={run.anchor for run in runs if run.replay is not None and kept[run.anchor] is None},
        most_of_replays=MOST_OF_A_PAGE,
        results=results,
        suite=suite,
        scenarios=scenarios,
        folded=len(runs) > MOST_OPEN_RUNS,
        damaged=[(run.metrics.directory, reason) for run in runs for reason in _damage(run)],
        comparisons=comparison_views(results),
        facts=facts(runs),
        rounds_of=rounds_of(runs),
        task_units=_task_units(results),
        shared=[
            plan_pictures([run.plan for run in runs if run.plan is not None]),
            marker_shapes(run.style for run in results.first_runs),
        ],
        data=page_data(scenarios),
        story_window=WINDOW_S,
        mode_verdicts=mode_verdicts,
        run_verdict=run_verdict,
        split=split,
        cards=cards,
        columns=quantity_columns(),
        area=EXACT,
        completeness=COMPLETENESS,
        success=SUCCESS,
        quantity_text=quantity_text,
        Mode=Mode,
    )
    with writing(out):
        out.absolute().parent.mkdir(parents=True, exist_ok=True)
    write_whole(out, printable(text))
    return out


def _damage(run: RunView) -> list[str]:
    """What could not be read of a run that is on the page."""
    cut = ["journal.jsonl: the last line was cut off"] if run.metrics.journal_truncated else []
    return [*cut, *run.metrics.journal_damaged, *run.damage]


def _task_units(results: Results) -> str:
    """How the switch names the task's units; with several tasks on the page each number is in its own."""
    diameter, field = results.units.diameter_m, results.units.field_of_view
    if diameter is None or field is None:
        return "D, FoV" if results.runs else ""
    return f"D = {100 * diameter:g} cm, FoV = {field:g}°"


def _parts(suite: SuiteView | None, scenarios: Sequence[ScenarioView]) -> list[tuple[str, str]]:
    """Anchors and names for the line of links."""
    parts = [("methods", "All methods")] if suite else []
    if len({run.label for scenario in scenarios for run in scenario.runs}) > 1:
        parts.append(("comparison", "Who is more repeatable"))
    parts += [(scenario.anchor if suite else f"{scenario.anchor}-waypoints", scenario.title) for scenario in scenarios]
    parts += [(f"{scenario.anchor}-failures", "Failures") for scenario in scenarios if scenario.failures][:1]
    return [*parts, ("what-was-run", "What was run"), ("how-to-read", "How to read this")]
