"""What the gate writes: a Markdown summary for the pull request, JUnit XML for the build server."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from itertools import groupby

from taskslam.evaluation.gate import Finding, GateReport, run_name
from taskslam.evaluation.quantities import quantity
from taskslam.evaluation.quantity import Dimension
from taskslam.printable import in_markdown, one_line, printable

DASH = "–"


def markdown(report: GateReport) -> str:
    """One heading, the verdict, a table of findings with the regressions first."""
    order = ("regression", "within noise", "undetermined", "better", "fine")
    lines = [f"## TaskSLAM-Bench: {headline(report)}", "", f"Rules: `{one_line(', '.join(report.rules))}`", ""]
    lines += [
        f"- **missing** {in_markdown(run_name(missing))}: {in_markdown(missing.reason)}" for missing in report.missing
    ]
    if report.missing:
        lines.append("")
    if report.findings:
        lines += [
            "| result | run | metric | base | new | ratio [95 %] |",
            "|---|---|---|---:|---:|---:|",
            *(
                f"| {_strong(f)} | {in_markdown(run_name(f))} | {f.metric} | {value(f, f.base)} | {value(f, f.new)} "
                f"| {ratio(f)} |"
                for f in sorted(report.findings, key=lambda finding: order.index(finding.status))
            ),
            "",
        ]
    lines += [f"- {in_markdown(run_name(f))}: {in_markdown(f.reason)}" for f in report.regressions]
    if report.added:
        lines.append(f"- not in BASE, not judged: {in_markdown(', '.join(report.added))}")
    return "\n".join(lines).rstrip() + "\n"


def junit(report: GateReport) -> str:
    """One test suite a run, one test case a rule; a missing run is a failed test case of its own."""
    root = ET.Element("testsuites", name="taskslam compare")
    for name, group in groupby(report.findings, key=run_name):
        findings = list(group)
        failures = sum(finding.status == "regression" for finding in findings)
        skipped = sum(finding.status == "undetermined" for finding in findings)
        suite = ET.SubElement(
            root,
            "testsuite",
            name=printable(name),
            tests=str(len(findings)),
            failures=str(failures),
            skipped=str(skipped),
        )
        for finding in findings:
            case = ET.SubElement(suite, "testcase", classname=printable(name), name=finding.metric)
            if finding.status == "regression":
                ET.SubElement(case, "failure", message=printable(finding.reason), type="regression")
            elif finding.status == "undetermined":
                ET.SubElement(case, "skipped", message=printable(finding.reason))
            else:
                ET.SubElement(case, "system-out").text = printable(f"{finding.status}: {finding.reason}")
    for missing in report.missing:
        name = run_name(missing)
        suite = ET.SubElement(root, "testsuite", name=printable(name), tests="1", failures="1", skipped="0")
        case = ET.SubElement(suite, "testcase", classname=printable(name), name="run")
        ET.SubElement(case, "failure", message=printable(missing.reason), type="missing")
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def headline(report: GateReport) -> str:
    """The verdict in a few words."""
    if report.passed:
        return "no regression"
    parts = []
    if report.regressions:
        count = len(report.regressions)
        parts.append(f"{count} regression" if count == 1 else f"{count} regressions")
    if report.missing:
        count = len(report.missing)
        parts.append(f"{count} missing run" if count == 1 else f"{count} missing runs")
    return ", ".join(parts)


def value(finding: Finding, number: float | None) -> str:
    """A value in its unit: centimetres, degrees, percent, or plain."""
    if number is None:
        return DASH
    dimension = quantity(finding.metric).dimension
    shown = dimension.value
    if dimension is Dimension.NUMBER:
        return f"{number:.4f}"
    digits = ".4g" if dimension is Dimension.SHARE else ".2f"
    return f"{shown.factor * number:{digits}} {shown.unit}"


def ratio(finding: Finding) -> str:
    """The ratio with its interval."""
    if finding.ratio is None:
        return DASH
    ends = finding.ratio_interval
    return f"{finding.ratio:.2f}" if ends is None else f"{finding.ratio:.2f} [{ends.low:.2f}, {ends.high:.2f}]"


def _strong(finding: Finding) -> str:
    return f"**{finding.status}**" if finding.status == "regression" else finding.status
