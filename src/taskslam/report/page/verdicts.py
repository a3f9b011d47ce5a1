"""The verdicts: plain sentences about who arrived, who failed and why, and who comes back most closely."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup, escape

from taskslam.evaluation import RunMetrics
from taskslam.report import words
from taskslam.report.page.comparison_view import ComparisonView
from taskslam.report.results import MethodResult, Run
from taskslam.report.units import Units

_MOST_NAMES = 8
_ALIKE = 1.25  # two spreads within this ratio are not told apart: five rounds do not say more
_MOST_COMPARED = 3  # sentences about who beats whom; the rest is in the matrix


def run_verdict(run: Run) -> Markup:
    """One sentence on one run: did it get there every time, and how closely do the arrivals agree?"""
    metrics = run.metrics
    rounds = "the one round" if metrics.rounds == 1 else f"all {metrics.rounds} rounds"
    if run.rounds_driven == 0:
        return escape("The run ended in its priming round, so that no round was driven.")
    if metrics.complete_waypoints == 0:
        only = f": only {run.rounds_driven} of them were driven" if run.rounds_driven < metrics.rounds else ""
        return escape(f"No waypoint was reached in {rounds}{only}, so there is no precision to state.")
    if metrics.complete_waypoints == metrics.planned_waypoints:
        reached = f"Every waypoint was reached in {rounds}"
    else:
        reached = f"{metrics.complete_waypoints} of {metrics.planned_waypoints} waypoints were reached in {rounds}"
    E = metrics.position.precision_m
    if E is None:
        return escape(f"{reached}. One round alone says nothing about precision.")
    return Markup("{}; arrivals lie {} from their mean.").format(reached, run.units.length(E, with_unit=True))


def split(metrics: RunMetrics, units: Units) -> Markup:
    """Where the distance to the goal comes from, and which part limits precision."""
    control, estimation = metrics.control, metrics.estimation
    if control.position_m is None or estimation.position_m is None:
        if metrics.complete_waypoints:
            return escape("Estimates, or their place against the measured poses, are not known: no shares to show.")
        return escape("No waypoint was reached in every round, so the two shares have no mean.")
    text = Markup(
        "When the robot stopped, SLAM put it {} from the goal (control), and it truly stood {} from there"
        " (estimation); means over the waypoints reached every time."
    ).format(units.length(control.position_m, True), units.length(estimation.position_m, True))
    if control.spread_m is None or estimation.spread_m is None:
        return text
    if max(control.spread_m, estimation.spread_m) <= _ALIKE * min(control.spread_m, estimation.spread_m):
        limit = "both limit precision about alike"
    else:
        limit = f"{'control' if control.spread_m > estimation.spread_m else 'estimation'} is what limits precision here"
    varied = Markup("{} From round to round the first varied by {}, the second by {}: {}.")
    return varied.format(text, units.length(control.spread_m, True), units.length(estimation.spread_m, True), limit)


def mode_verdicts(
    ranked: Sequence[MethodResult], units: Units, compared: ComparisonView | None, absent: Sequence[str]
) -> list[Markup]:
    """Sentences on all methods in one mode. ranked: the most complete and then the most precise first.

    absent: methods that ran in another mode only.
    """
    references = [result for result in ranked if result.is_reference]
    methods = [result for result in ranked if not result.is_reference]
    sentences = [*_arrived(methods, units), *_more_repeatable(methods, compared)]
    sentences += [_fell_short(result) for result in methods if not result.complete]
    sentences += [_reference(result, units) for result in references]
    if absent:
        names = listed([bold(name) for name in absent])
        sentences.append(Markup("{} {} no run in this mode.").format(names, "has" if len(absent) == 1 else "have"))
    return sentences


def _arrived(methods: Sequence[MethodResult], units: Units) -> list[Markup]:
    if not methods:
        return []
    complete = [result for result in methods if result.complete]
    of_all = words.count(len(methods), "method")
    if not complete:
        best = methods[0]
        if not best.pooled.complete_waypoints:
            return [escape("No method reached any waypoint in every round.")]
        share = words.percent(best.pooled.completeness)
        return [Markup("No method reached every waypoint in every round; {} came furthest with {} %.").format(
            bold(best.label), share)]  # fmt: skip
    names = listed([bold(result.label) for result in complete])
    sentence = Markup("{} of {} reached every waypoint in every round: {}.").format(len(complete), of_all, names)
    pooled = complete[0].pooled
    E, between = pooled.position.precision_m, pooled.uncertainty.precision_m
    if E is None:
        return [sentence]
    said = units.length(E, with_unit=True)
    if between is not None:
        said = Markup("{} (95 %: {})").format(said, units.interval(between))
    closest = Markup("The closest arrivals among them are those of {}: on average {} from their mean.")
    return [sentence, closest.format(bold(complete[0].label), said)]


def _more_repeatable(methods: Sequence[MethodResult], compared: ComparisonView | None) -> list[Markup]:
    """Who is more repeatable than whom, where the data carry it; references compete with nobody."""
    if compared is None or len(methods) < 2:
        return []
    names = {result.label for result in methods}
    betters: dict[tuple[str, ...], list[str]] = {}
    for result in methods:
        worse = tuple(sorted(name for name in compared.beaten_by(result.label) if name in names))
        if worse:
            betters.setdefault(worse, []).append(result.label)
    sentences = [_more_repeatable_than(better, worse) for worse, better in list(betters.items())[:_MOST_COMPARED]]
    pairs = [pair for pair in compared.pairs if pair.a in names and pair.b in names]
    apart = sum(pair.told_apart for pair in pairs)
    if not pairs:
        return []
    summary = Markup('The data tell {} of {} apart (95 %, corrected); <a href="#comparison">all of them</a>.')
    return [*sentences, summary.format(apart, words.count(len(pairs), "pair"))]


def _more_repeatable_than(better: Sequence[str], worse: Sequence[str]) -> Markup:
    verb = "is" if len(better) == 1 else "are each"
    those = (listed([bold(name) for name in names]) for names in (better, worse))
    return Markup("{} {} more repeatable than {}.").format(next(those), verb, next(those))


def _fell_short(result: MethodResult) -> Markup:
    """How far a method came, and the reasons, the most frequent first."""
    pooled = result.pooled
    primed = sum(run.rounds_driven == 0 for run in result.runs)
    parts = (
        words.outcomes(pooled.failures_by_kind),
        f"{words.count(primed, 'run')} ended in the priming round" if primed else "",
        f"{words.count(pooled.missing_runs, 'run')} missing" if pooled.missing_runs else "",
    )
    reasons = "; ".join(filter(None, parts))
    return Markup("{} reached {} of {} waypoints every time{}.").format(
        bold(result.label), pooled.complete_waypoints, pooled.planned_waypoints, f": {reasons}" if reasons else ""
    )


def _reference(result: MethodResult, units: Units) -> Markup:
    E = result.pooled.position.precision_m
    what = Markup("{} is told the truth and shows what navigation alone can do").format(bold(result.label))
    if E is None:
        return Markup("{}.").format(what)
    return Markup("{}: {}.").format(what, units.length(E, with_unit=True))


def bold(name: str) -> Markup:
    """A method's name in a sentence."""
    return Markup("<b>{}</b>").format(name)


def listed(names: Sequence[Markup]) -> Markup:
    """`a`, `a and b`, `a, b and c`; of many only the first."""
    if len(names) > _MOST_NAMES:
        rest = len(names) - _MOST_NAMES + 1
        names = [*names[: _MOST_NAMES - 1], escape(f"{rest} more")]
    if len(names) == 1:
        return names[0]
    return Markup("{} and {}").format(Markup(", ").join(names[:-1]), names[-1])
