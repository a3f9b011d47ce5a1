"""The gate: did results get worse? For the continuous integration of a SLAM project.

Runs of BASE and NEW are paired by scenario, method, mode and seed; the runs of a method in a mode are also judged all
together, which shows a small loss that no single run can. How a change is told from chance, each quantity says itself
(`Judged`). E and e are measured, so a change counts only if it is larger than the tolerance and the rounds tell it from
none (`comparison.py`, one family over all runs and rules). Completeness is counted: a waypoint that was reached in
every round, and now is not, is an event and no scatter. Only the tolerance excuses it. An area under the curve depends
on both and follows both rules. Of any other quantity a loss beyond the tolerance counts if the intervals lie apart. A
run that NEW lacks is a regression.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from pydantic import BaseModel, ConfigDict

from taskslam.errors import InputError, did_you_mean
from taskslam.evaluation.comparison import compare_pair, corrected
from taskslam.evaluation.metrics_file import Comparison, Interval, LeftOut, RunMetrics
from taskslam.evaluation.quantities import quantities
from taskslam.evaluation.quantities.published import PRECISION
from taskslam.evaluation.quantity import Judged, Quantity, WorseIs

GATE_FORMAT: Literal["taskslam-compare/1"] = "taskslam-compare/1"
DEFAULT_RULES = "precision:+10%,accuracy:+10%,completeness:-0"

Status: TypeAlias = Literal["regression", "within noise", "fine", "better", "undetermined"]
RunKey: TypeAlias = tuple[str, str, str, int]
Pair: TypeAlias = tuple[RunMetrics, RunMetrics]

_RULE = re.compile(r"(?P<sign>[+-])(?P<number>\d+(\.\d*)?|\.\d+)(?P<unit>%|cm|deg|)")
_CLOSE = 1e-9


@dataclass(frozen=True, slots=True)
class Rule:
    """How much worse a quantity may get: relative (a share of BASE), or absolute in metres, radians or shares."""

    quantity: Quantity
    tolerance: float
    relative: bool

    @property
    def metric(self) -> str:
        """The quantity's key."""
        return self.quantity.key

    def exceeded(self, base: float, new: float) -> bool:
        """Whether NEW is worse than BASE by more than the tolerance."""
        loss = (new - base) if self.quantity.worse_is is WorseIs.MORE else (base - new)
        return loss > self.tolerance * (base if self.relative else 1.0) + _CLOSE

    def __str__(self) -> str:
        sign = self.quantity.worse_is.value
        if self.relative:
            return f"{self.metric}:{sign}{100 * self.tolerance:g}%"
        unit, factor = _absolute(self.quantity)
        return f"{self.metric}:{sign}{factor * self.tolerance:g}{unit}"


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Finding(_Part):
    """One metric of one run; or of all runs of a method in a mode together, then scenario says so and seed is null.

    base, new: metres or shares; ratio: new over base on common waypoints, with interval.
    """

    scenario: str
    method: str
    mode: str
    seed: int | None
    metric: str
    base: float | None
    new: float | None
    ratio: float | None
    ratio_interval: Interval | None
    p_adjusted: float | None
    status: Status
    reason: str


class MissingRun(_Part):
    """A run of BASE that NEW does not have, and why if that is known."""

    scenario: str
    method: str
    mode: str
    seed: int
    reason: str


class GateReport(_Part):
    """The result of the gate. added: runs that BASE does not have; they are not judged."""

    format: Literal["taskslam-compare/1"] = GATE_FORMAT
    rules: tuple[str, ...]
    findings: tuple[Finding, ...]
    missing: tuple[MissingRun, ...]
    added: tuple[str, ...]

    @property
    def regressions(self) -> tuple[Finding, ...]:
        """The findings that are regressions; missing runs are regressions besides."""
        return tuple(finding for finding in self.findings if finding.status == "regression")

    @property
    def passed(self) -> bool:
        """Whether nothing got worse and nothing is missing."""
        return not self.regressions and not self.missing


def parse_rules(text: str) -> tuple[Rule, ...]:
    """Rules from `precision:+10%,completeness:-0`. Raises InputError naming the part that is wrong."""
    known = {one.key: one for one in quantities()}
    rules: list[Rule] = []
    for part in (part.strip() for part in text.split(",") if part.strip()):
        name, _, amount = part.partition(":")
        of = known.get(name.strip())
        if of is None:
            raise InputError(
                f"--fail-on {part}: unknown metric {name!r}; expected one of {', '.join(known)}."
                f"{did_you_mean(name, known)}"
            )
        sign, (own, factor) = of.worse_is.value, _absolute(of)
        found = _RULE.fullmatch(amount.strip())
        if found is None or found["sign"] != sign or found["unit"] not in ("%", own):
            raise InputError(f"--fail-on {part}: expected {of.key}:{sign}10% or {of.key}:{sign}{0.05 * factor:g}{own}")
        if any(rule.quantity is of for rule in rules):
            raise InputError(f"--fail-on {part}: a second rule for {of.key}; expected one")
        relative = found["unit"] == "%"
        rules.append(Rule(of, float(found["number"]) / (100 if relative else factor), relative))
    if not rules:
        raise InputError(f"--fail-on: no rule; expected some, such as {DEFAULT_RULES}")
    return tuple(rules)


def _absolute(of: Quantity) -> tuple[str, float]:
    """The unit of an absolute tolerance and how many of it are one SI unit; shares are plain numbers."""
    shown = of.dimension.value
    return (shown.unit, shown.factor) if shown.si else ("", 1.0)


def judge(
    base: Sequence[RunMetrics], new: Sequence[RunMetrics], rules: Sequence[Rule], left_out: Sequence[LeftOut] = ()
) -> GateReport:
    """Compare the runs of NEW with those of BASE. left_out: what could not be evaluated of NEW.

    Raises InputError if either holds one run twice, or if paired runs had different goals or local planners.
    """
    olds, news = _by_key(base, "BASE"), _by_key(new, "NEW")
    pairs = [(olds[key], news[key]) for key in sorted(olds) if key in news]
    for old, fresh in pairs:
        if [w.target for w in old.waypoints] != [w.target for w in fresh.waypoints]:
            raise InputError(
                f"{run_name(old)}: BASE and NEW were driven to different goals; expected the same sequence"
            )
        if old.planner and fresh.planner and old.planner != fresh.planner:
            raise InputError(
                f"{run_name(old)}: BASE was steered by planner {old.planner} and NEW by {fresh.planner}; expected one"
            )
        if old.behaviour is not None and fresh.behaviour is not None and old.behaviour != fresh.behaviour:
            raise InputError(
                f"{run_name(old)}: BASE was driven under behaviour version {old.behaviour} of taskslam and NEW under"
                f" {fresh.behaviour}, which are never compared; drive BASE again"
            )
    groups = [*([pair] for pair in pairs), *_together(pairs)]
    wanted = sorted({asked for rule in rules if (asked := _asked(rule)) is not None})
    questions = [(index, metric) for index in range(len(groups)) for metric in wanted]
    answers = corrected([_compare(groups[index], metric) for index, metric in questions])
    known = dict(zip(questions, answers, strict=True))
    findings = []
    for index, group in enumerate(groups):
        for rule in rules:
            answer = known.get((index, _asked(rule) or ""))
            if len(group) == 1:
                findings.append(_finding(*group[0], rule, answer))
            elif rule.quantity.judged is Judged.ARRIVALS and answer is not None and answer.ratio is not None:
                findings.append(_joint_finding(group, rule, answer))
    return GateReport(
        rules=tuple(str(rule) for rule in rules),
        findings=tuple(findings),
        missing=tuple(_missing(olds[key], left_out) for key in sorted(olds) if key not in news),
        added=tuple(run_name(news[key]) for key in sorted(news) if key not in olds),
    )


def run_name(run: RunMetrics | Finding | MissingRun) -> str:
    """Scenario, method, mode and seed: what names a run in BASE and in NEW."""
    seed = "" if run.seed is None else f" / seed {run.seed}"
    return f"{run.scenario} / {run.method} / {run.mode}{seed}"


def _asked(rule: Rule) -> str | None:
    """What of the arrivals decides a rule: the metric that `comparison.py` compares, or None."""
    return {Judged.ARRIVALS: rule.metric, Judged.BOTH: PRECISION.key}.get(rule.quantity.judged)


def _key(run: RunMetrics) -> RunKey:
    return (run.scenario, run.method, run.mode, run.seed)


def _by_key(runs: Sequence[RunMetrics], side: str) -> dict[RunKey, RunMetrics]:
    found: dict[RunKey, RunMetrics] = {}
    for run in runs:
        if _key(run) in found:
            first = found[_key(run)].directory
            raise InputError(
                f"{side} holds {run_name(run)} twice, in {first} and in {run.directory}; name a folder with one of them"
            )
        found[_key(run)] = run
    return found


def _missing(run: RunMetrics, left_out: Sequence[LeftOut]) -> MissingRun:
    reason = next((left.reason for left in left_out if left.directory == run.directory), "no such run")
    return MissingRun(scenario=run.scenario, method=run.method, mode=run.mode, seed=run.seed, reason=reason)


def _together(pairs: Sequence[Pair]) -> list[list[Pair]]:
    """The pairs of each method and mode that has several."""
    groups: dict[tuple[str, str], list[Pair]] = {}
    for pair in pairs:
        groups.setdefault((pair[0].method, pair[0].mode), []).append(pair)
    return [group for _, group in sorted(groups.items()) if len(group) > 1]


def _compare(pairs: Sequence[Pair], metric: str) -> Comparison:
    return compare_pair("new", [fresh for _, fresh in pairs], "base", [old for old, _ in pairs], metric)


def _joint_finding(pairs: Sequence[Pair], rule: Rule, answer: Comparison) -> Finding:
    old, new = pairs[0]
    status, reason = _judge_measured(old, new, rule, answer)
    return Finding(
        scenario=f"all {len(pairs)} runs",
        method=old.method,
        mode=old.mode,
        seed=None,
        metric=rule.metric,
        base=answer.b_mean_m,
        new=answer.a_mean_m,
        ratio=answer.ratio,
        ratio_interval=answer.ratio_interval,
        p_adjusted=answer.p_adjusted,
        status=status,
        reason=reason,
    )


def _finding(old: RunMetrics, new: RunMetrics, rule: Rule, answer: Comparison | None) -> Finding:
    measured = rule.quantity.judged is Judged.ARRIVALS
    if measured:
        assert answer is not None
        status, reason = _judge_measured(old, new, rule, answer)
    elif rule.quantity.judged is Judged.INTERVAL:
        status, reason = _judge_by_intervals(old, new, rule)
    else:
        status, reason = _judge_counted(old, new, rule)
        both = rule.quantity.judged is Judged.BOTH
        if both and status == "regression" and new.completeness >= old.completeness and answer is not None:
            worse = answer.told_apart and answer.ratio is not None and answer.ratio > 1
            status, reason = ("regression", answer.verdict) if worse else ("within noise", answer.verdict)
    shown = answer if measured else None
    return Finding(
        scenario=old.scenario,
        method=old.method,
        mode=old.mode,
        seed=old.seed,
        metric=rule.metric,
        base=shown.b_mean_m if shown and shown.waypoints else _value(old, rule),
        new=shown.a_mean_m if shown and shown.waypoints else _value(new, rule),
        ratio=shown.ratio if shown else None,
        ratio_interval=shown.ratio_interval if shown else None,
        p_adjusted=shown.p_adjusted if shown else None,
        status=status,
        reason=reason,
    )


def _judge_measured(old: RunMetrics, new: RunMetrics, rule: Rule, answer: Comparison) -> tuple[Status, str]:
    if answer.ratio is None or answer.a_mean_m is None or answer.b_mean_m is None:
        if _value(old, rule) is not None and _value(new, rule) is None:
            return "regression", f"no {rule.metric} any more: {_reached(new)}, before {_reached(old)}"
        return "undetermined", answer.verdict
    if answer.ratio_interval is None:
        return "undetermined", answer.verdict
    beyond = answer.ratio > 1 + rule.tolerance + _CLOSE if rule.relative else rule.exceeded(
        answer.b_mean_m, answer.a_mean_m
    )  # fmt: skip
    if beyond:
        return ("regression" if answer.told_apart and answer.ratio > 1 else "within noise"), answer.verdict
    return ("better" if answer.told_apart and answer.ratio < 1 else "fine"), answer.verdict


def _judge_counted(old: RunMetrics, new: RunMetrics, rule: Rule) -> tuple[Status, str]:
    before, after = _value(old, rule), _value(new, rule)
    legs = f"{new.uncertainty.legs.failed} of {new.uncertainty.legs.driven} legs failed, before"
    reason = f"{_reached(new)}, before {_reached(old)}; {legs} {old.uncertainty.legs.failed} of"
    reason = f"{reason} {old.uncertainty.legs.driven}"
    if before is None:
        return "undetermined", f"BASE has no {rule.metric}: it holds one round"
    if after is None:
        return "regression", f"no {rule.metric} any more: NEW holds one round"
    if rule.exceeded(before, after):
        return "regression", reason
    return ("better" if after > before + _CLOSE else "fine"), reason


def _judge_by_intervals(old: RunMetrics, new: RunMetrics, rule: Rule) -> tuple[Status, str]:
    before, after = _value(old, rule), _value(new, rule)
    if before is None:
        return "undetermined", f"BASE has no {rule.metric}"
    if after is None:
        return "regression", f"no {rule.metric} any more: {_reached(new)}, before {_reached(old)}"
    ends = [rule.quantity.interval([run], run.uncertainty) if rule.quantity.interval else None for run in (old, new)]
    if not rule.exceeded(before, after):
        return "fine", "within the tolerance"
    if None in ends:
        return "regression", "beyond the tolerance; no interval tells how sure it is"
    (base, fresh) = (end for end in ends if end is not None)
    apart = fresh.low > base.high if rule.quantity.worse_is is WorseIs.MORE else fresh.high < base.low
    told = f"beyond the tolerance, and the intervals {'lie apart' if apart else 'overlap'}"
    return ("regression" if apart else "within noise"), told


def _value(run: RunMetrics, rule: Rule) -> float | None:
    return rule.quantity.of_runs([run], ())


def _reached(run: RunMetrics) -> str:
    return f"{run.complete_waypoints}/{run.planned_waypoints} waypoints reached in all {run.rounds} rounds"
