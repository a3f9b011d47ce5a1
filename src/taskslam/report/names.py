"""Names of methods on pages, figures and tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from taskslam.record import Manifest


def method_labels(manifests: Sequence[Manifest]) -> list[str]:
    """The name of each run's method, with what differs where it was run in several ways.

    Options, latencies and local planners always count as ways; robots (a method's scenarios may each have their own)
    where the same tour was driven twice.
    """
    tours = Counter(_tour(manifest) for manifest in manifests)
    twice = {manifest.method for manifest in manifests if tours[_tour(manifest)] > 1}
    ways = [(*_ways(manifest), _robot(manifest) if manifest.method in twice else "") for manifest in manifests]
    known: dict[str, list[set[str]]] = {}
    for manifest, own in zip(manifests, ways, strict=True):
        for seen, way in zip(known.setdefault(manifest.method, [set() for _ in own]), own, strict=True):
            seen.add(way)
    labels = []
    for manifest, own in zip(manifests, ways, strict=True):
        parts = [way for seen, way in zip(known[manifest.method], own, strict=True) if len(seen) > 1 and way]
        labels.append(f"{manifest.method} ({', '.join(parts)})" if parts else manifest.method)
    return labels


def _ways(manifest: Manifest) -> tuple[str, str, str]:
    options = ", ".join(f"{key} = {value}" for key, value in sorted(manifest.method_options.items()))
    planner = "" if manifest.planner is None else f"{manifest.planner} planner"
    return (options or "default options", f"{manifest.latency} latency", planner)


def _robot(manifest: Manifest) -> str:
    return Path(str(manifest.scenario.get("robot", ""))).stem


def _tour(manifest: Manifest) -> tuple[object, ...]:
    return (manifest.method, *_ways(manifest), manifest.scenario_name, manifest.mode, manifest.seed)


def short_names(names: Sequence[str], most: int) -> list[str]:
    """Each name within `most` letters, its middle left out where it is longer; names that differ stay different."""
    short: list[str] = []
    for name in names:
        text = name if len(name) <= most else f"{name[: most - most // 3 - 1]}…{name[-(most // 3) :]}"
        number = 2
        while text in short:
            tail = f"…{number}"
            text = name[: most - len(tail)] + tail
            number += 1
        short.append(text)
    return short
