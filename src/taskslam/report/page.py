"""One self-contained page: verdict first, then the pictures and tables that support it, then what was run."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from taskslam.evaluation import read_runs
from taskslam.record.files import write_whole, writing
from taskslam.report import cards, palette, words
from taskslam.report.markers import method_styles
from taskslam.report.suite import is_suite, suite_view
from taskslam.report.views import method_labels, run_view, scenario_view

MOST_OPEN_RUNS = 4  # with more runs than these, what belongs to a single run is folded away


def write_report(folders: Sequence[Path], out: Path) -> Path:
    """Write the page about all finished runs at or below the given folders; returns its path.

    With several scenarios or more than two methods it opens with an overview of all of them (`suite.py`). Runs that
    cannot be read are named on the page and left out. Raises RecordError if there is no run at all, DiskFullError if
    the page cannot be written.
    """
    read, left_out = read_runs(folders)
    labels = method_labels([record.manifest for record, _ in read])
    styles = method_styles(labels)
    runs = [
        run_view(f"run-{index}", label, record, metrics, styles[label])
        for index, (label, (record, metrics)) in enumerate(zip(labels, read, strict=True), start=1)
    ]
    whole_suite = is_suite(runs)
    scenarios = [
        scenario_view([run for run in runs if run.metrics.scenario == name], whole_suite)
        for name in sorted({run.metrics.scenario for run in runs})
    ]
    environment = Environment(
        loader=PackageLoader("taskslam.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    style = resources.files("taskslam.report").joinpath("templates", "style.css").read_text(encoding="utf-8")
    text = environment.get_template("report.html").render(
        suite=suite_view(runs, scenarios) if whole_suite else None,
        scenarios=scenarios,
        folded=len(runs) > MOST_OPEN_RUNS,
        left_out=left_out,
        words=words,
        cards=cards,
        palette=palette,
        style=Markup(style),  # noqa: S704 our own file, no input in it
    )
    with writing(out):
        out.absolute().parent.mkdir(parents=True, exist_ok=True)
    write_whole(out, text)
    return out
