"""The rows of a table: every method in every mode at every scenario, over all seeds that it was driven with."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from taskslam.evaluation.metrics_file import Row, RunMetrics
from taskslam.evaluation.pooled import missing_sequences, pool
from taskslam.evaluation.quantities import measured
from taskslam.evaluation.upstream import NONE, Deviations


def rows_of(groups: Mapping[str, Sequence[RunMetrics]], deviations: Deviations = NONE) -> tuple[Row, ...]:
    """Rows by scenario, method and mode. groups: runs by the name of their method, of all methods."""
    everything: dict[tuple[str, str], list[RunMetrics]] = {}
    own: dict[tuple[str, str, str], list[RunMetrics]] = {}
    for name, runs in groups.items():
        for run in runs:
            everything.setdefault((run.scenario, run.mode), []).append(run)
            own.setdefault((run.scenario, name, run.mode), []).append(run)
    return tuple(
        _row(key, sorted(own[key], key=lambda run: run.seed), everything[key[0], key[2]], deviations)
        for key in sorted(own)
    )


def _row(
    key: tuple[str, str, str], runs: Sequence[RunMetrics], everything: Sequence[RunMetrics], deviations: Deviations
) -> Row:
    scenario, name, mode = key
    missing = missing_sequences(runs, everything, deviations)
    pooled = pool(runs, missing)
    alone = len(runs) == 1 and not missing
    peaks = [run.method_peak_bytes for run in runs if run.method_peak_bytes is not None]
    return Row(
        scenario=scenario,
        method=name,
        mode=mode,
        seeds=tuple(run.seed for run in runs),
        directories=tuple(run.directory for run in runs),
        missing=len(missing),
        rounds=tuple(sorted({run.rounds for run in runs})),
        complete_waypoints=pooled.complete_waypoints,
        planned_waypoints=pooled.planned_waypoints,
        completeness=pooled.completeness,
        position=pooled.position,
        orientation=pooled.orientation,
        n_auc=pooled.area,
        uncertainty=pooled.uncertainty,
        quantities=runs[0].quantities if alone else measured(runs, missing, pooled.uncertainty),
        failures_by_kind=pooled.failures_by_kind,
        simulated_s=math.fsum(run.simulated_s for run in runs),
        wall_s=math.fsum(run.wall_s for run in runs),
        compute_s=pooled.compute_s,
        real_time_factor=pooled.real_time_factor,
        frames=pooled.frames,
        dropped_frames=pooled.dropped_frames,
        method_peak_bytes=max(peaks, default=None),
    )
