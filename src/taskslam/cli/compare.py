"""`taskslam compare`: did results get worse? A gate for continuous integration."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import say, standard_output
from taskslam.mode import Mode

if TYPE_CHECKING:
    from rich.table import Table
    from rich.text import Text

    from taskslam.evaluation.gate import Finding, GateReport


def compare(
    base: Annotated[Path, typer.Argument(help="The results to hold on to: a folder with runs, or a metrics.json.")],
    new: Annotated[Path, typer.Argument(help="The results to judge: a folder with runs, or a metrics.json.")],
    fail_on: Annotated[
        str,
        typer.Option(help="How much worse each quantity may get; docs/metrics.md lists them."),
    ] = "precision:+10%,accuracy:+10%,completeness:-0",
    markdown: Annotated[Path | None, typer.Option(help="Write a summary in Markdown, for a pull request.")] = None,
    junit: Annotated[Path | None, typer.Option(help="Write JUnit XML, for a build server.")] = None,
    json: Annotated[Path | None, typer.Option(help="Write all findings as JSON.")] = None,
) -> None:
    """Compare two sets of results. Exit status 0: nothing got worse; 1: something did; 2: wrong input.

    Runs are paired by scenario, method, mode and seed. Precision and accuracy count as worse only if the change exceeds
    the tolerance and the rounds tell it from none, at 5 % over all comparisons together; a change in completeness is
    never noise. A run that NEW lacks counts as worse.

    Examples:
        taskslam compare main-results results

        taskslam compare main/metrics.json results --fail-on precision:+10%,completeness:-0 --markdown summary.md

        taskslam compare main-results results --fail-on accuracy:+1cm,heading_precision:+0.5deg --junit compare.xml
    """
    from taskslam.evaluation import gate, gate_files
    from taskslam.evaluation.evaluate import load_metrics
    from taskslam.files import write_whole

    rules = gate.parse_rules(fail_on)
    old, fresh = load_metrics(base), load_metrics(new)
    report = gate.judge(old.runs, fresh.runs, rules, fresh.left_out)
    for path, text in (
        (markdown, gate_files.markdown),
        (junit, gate_files.junit),
        (json, lambda found: found.model_dump_json(indent=2) + "\n"),
    ):
        if path is not None:
            write_whole(path, text(report))
    console = standard_output()
    if report.findings:
        console.print(_table(report))
    for finding in report.regressions:
        console.print(f"Regression: {gate.run_name(finding)}: {finding.reason}")
    for missing in report.missing:
        console.print(f"Missing: {gate.run_name(missing)}: {missing.reason}")
    for name in report.added:
        console.print(f"Not in BASE, not judged: {name}")
    for side, left in ((base, old.left_out), (new, fresh.left_out)):
        for one in left:
            say(f"Left out {side / one.directory}: {one.reason}", err=True)
    console.print(gate_files.headline(report).capitalize() + ".")
    if not report.passed:
        raise typer.Exit(1)


def _table(report: GateReport) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from taskslam.evaluation import gate, gate_files

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), show_lines=True)
    table.add_column("run", overflow="fold")
    table.add_column("metric", no_wrap=True)
    for name in ("base", "new", "ratio [95 %]"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("result", no_wrap=True)
    for _, group in groupby(report.findings, key=gate.run_name):
        found = list(group)
        first = found[0]
        where = Mode(first.mode).words
        table.add_row(
            Text(
                "\n".join(
                    (first.scenario, first.method, where + ("" if first.seed is None else f", seed {first.seed}"))
                )
            ),
            "\n".join(finding.metric for finding in found),
            "\n".join(gate_files.value(finding, finding.base) for finding in found),
            "\n".join(gate_files.value(finding, finding.new) for finding in found),
            Text("\n".join(gate_files.ratio(finding) for finding in found)),
            Text("\n").join(_result(finding) for finding in found),
        )
    return table


def _result(finding: Finding) -> Text:
    from rich.text import Text

    return Text(finding.status, style="bold red" if finding.status == "regression" else "")
