"""How a method is called where it was run in several ways: in metrics.json, on pages, in figures and tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from taskslam.evaluation.metrics_file import RunMetrics


def method_labels(runs: Sequence[RunMetrics]) -> list[str]:
    """The name of each run's method, with what differs where it was run in several ways.

    Options, latencies, local planners and behaviour versions always count as ways; robots (a method's scenarios may
    each have their own) where the same tour was driven twice. What is not known of a run is no way of its own.
    """
    tours = Counter(_tour(run) for run in runs)
    twice = {run.method for run in runs if tours[_tour(run)] > 1}
    ways = [(*_ways(run), (run.robot or "") if run.method in twice else "") for run in runs]
    known: dict[str, list[set[str]]] = {}
    for run, own in zip(runs, ways, strict=True):
        for seen, way in zip(known.setdefault(run.method, [set() for _ in own]), own, strict=True):
            if way:
                seen.add(way)
    labels = []
    for run, own in zip(runs, ways, strict=True):
        parts = [way for seen, way in zip(known[run.method], own, strict=True) if len(seen) > 1 and way]
        labels.append(f"{run.method} ({', '.join(parts)})" if parts else run.method)
    return labels


def options_in_words(options: Mapping[str, object]) -> str:
    """A method's options, or that there are none."""
    return ", ".join(f"{key} = {value}" for key, value in sorted(options.items())) or "default options"


def _ways(run: RunMetrics) -> tuple[str, ...]:
    latency = "" if run.latency is None else f"{run.latency} latency"
    planner = "" if run.planner is None else f"{run.planner} planner"
    behaviour = "" if run.behaviour is None else f"behaviour version {run.behaviour}"
    return (options_in_words(run.method_options), latency, planner, behaviour)


def _tour(run: RunMetrics) -> tuple[object, ...]:
    return (run.method, *_ways(run), run.scenario, run.mode, run.seed)
