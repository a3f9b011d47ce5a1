"""How many rounds and seeds a campaign needs to tell its methods apart (`evaluation/power.py`), as it plans them."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from taskslam.benchmark.spec import RunSpec
from taskslam.errors import InputError, RecordError
from taskslam.evaluation.evaluate import evaluate_runs
from taskslam.evaluation.metrics_file import RunMetrics
from taskslam.evaluation.power import ASSUMED, MOST_SEEDS, Scatter, pooled_scatter, runs_needed, scatter_of


def share_of(text: str) -> float:
    """A difference as a person says it, `20%` or 0.2. Raises InputError."""
    found = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*(%?)\s*", text)
    share = float(found[1]) / (100 if found[2] else 1) if found else 0.0
    if not 0.005 <= share <= 10:
        raise InputError(f"--detect {text}: expected a difference of E such as 20%, from 0.5% to 1000%")
    return share


def design_words(specs: Sequence[RunSpec], folder: Path, detect: float) -> str:
    """A sentence: rounds and seeds that find a relative difference of E between any two methods of these runs.

    The scatter is that of the finished runs in the folder, if some method has two seeds there, and assumed otherwise.
    """
    methods = len({spec.way for spec in specs})
    pairs = max(1, methods * (methods - 1) // 2)
    found = _scatters(folder)
    scatter = pooled_scatter(found) if found else ASSUMED
    design = runs_needed(detect, scatter, comparisons=pairs)
    between = f"between any two of {methods} methods" if methods > 2 else "between two methods"
    basis = f"the scatter of {len(found)} driven so far" if found else "an assumed scatter; a few runs tell it better"
    needed = design.words if design is not None else f"more than {MOST_SEEDS} seeds"
    return f"to find a difference of {detect:.0%} of E {between}: {needed} ({basis})"


def _scatters(folder: Path) -> list[Scatter]:
    """Of every method, mode and place with several finished seeds in the folder."""
    try:
        runs = evaluate_runs([folder]).runs
    except RecordError:
        return []
    groups: dict[tuple[object, ...], list[RunMetrics]] = defaultdict(list)
    for run in runs:
        groups[run.scenario, run.method, run.mode, repr(run.method_options), run.latency, run.robot].append(run)
    return [scatter for group in groups.values() if (scatter := scatter_of(group)) is not None]
