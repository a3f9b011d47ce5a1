"""Names of methods on pages, figures and tables."""

from __future__ import annotations

import json
from collections.abc import Sequence

from taskslam.record import Manifest


def method_labels(manifests: Sequence[Manifest]) -> list[str]:
    """The name of each run's method; where one was run with several options or latencies, with what differs."""
    variants: dict[str, set[str]] = {}
    latencies: dict[str, set[str]] = {}
    for manifest in manifests:
        variants.setdefault(manifest.method, set()).add(json.dumps(manifest.method_options, sort_keys=True))
        latencies.setdefault(manifest.method, set()).add(manifest.latency)
    labels = []
    for manifest in manifests:
        parts = []
        if len(variants[manifest.method]) > 1:
            options = sorted(manifest.method_options.items())
            parts += [f"{key} = {value}" for key, value in options] or ["default options"]
        if len(latencies[manifest.method]) > 1:
            parts.append(f"{manifest.latency} latency")
        labels.append(f"{manifest.method} ({', '.join(parts)})" if parts else manifest.method)
    return labels


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
