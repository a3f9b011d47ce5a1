"""What figures keep of recorded runs: few enough numbers that a study of a thousand runs fits into memory."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from taskslam.errors import TrajectoryError
from taskslam.evaluation.trajectory_errors import PoseErrors, absolute_errors, relative_errors
from taskslam.evaluation.trajectory_pairs import DeltaUnit, pairs
from taskslam.evaluation.trajectory_timing import gap_steps
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.record.trajectories import SpatialTrajectory
from taskslam.report.simplify import simplified
from taskslam.studies.study_comparison import AlignedRun

ABSOLUTE = "ATE"
_BINS = 240  # over the time of the ground truth
_QUANTILES = np.linspace(0.0, 1.0, 201)
_FINEST = 1 / 1500  # of the greatest extent: what leaving points out may move a path by
_SHOWN = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True)
class Ground:
    """A sequence's ground truth. axes: the two coordinates that are drawn, and the third; path: (K, 2) m.

    times: (B,) s from its start; third: (B,) m of the third coordinate; duration_s: of all of it.
    """

    axes: tuple[int, int, int]
    path: FloatArray
    times: FloatArray
    third: FloatArray
    duration_s: float
    begin: int
    finest: float
    rises: bool


@dataclass(frozen=True)
class Stretch:
    """Poses of a run without a gap. path: (K, 2) m; the rest (B,) by time, s from the start of the ground truth.

    errors: m, turns: rad, root mean squares; third: m.
    """

    begin_s: float
    end_s: float
    path: FloatArray
    times: FloatArray
    errors: FloatArray
    turns: FloatArray
    third: FloatArray


@dataclass(frozen=True)
class DrawnRun:
    """A run on the ground truth. spreads: for ATE and each length of RPE, (2, Q) quantiles: m and rad."""

    sequence: str
    method: str
    file: str
    stretches: tuple[Stretch, ...]
    spreads: dict[str, FloatArray]


def ground(truth: SpatialTrajectory, level: bool) -> Ground:
    """The ground truth. level: it is drawn in x and y, as on a map; else in the two coordinates that it spans most."""
    extents = np.ptp(truth.positions, axis=0)
    third = 2 if level else int(np.argmin(extents))
    first, second = (axis for axis in range(3) if axis != third)
    finest = float(extents.max()) * _FINEST
    seconds = (truth.stamps - truth.stamps[0]) / NANOSECONDS
    rows = np.unique(np.linspace(0, len(truth) - 1, min(len(truth), _BINS)).round().astype(np.int64))
    return Ground(
        axes=(first, second, third),
        path=simplified(truth.positions[:, [first, second]], finest),
        times=seconds[rows],
        third=truth.positions[rows, third],
        duration_s=float(seconds[-1]),
        begin=int(truth.stamps[0]),
        finest=finest,
        rises=bool(extents[third] > 0.02 * extents.max()),
    )


def drawn_run(
    sequence: str, method: str, run: AlignedRun, on: Ground, deltas: Iterable[tuple[float, DeltaUnit]]
) -> DrawnRun:
    """A run that was laid on the ground truth."""
    errors = absolute_errors(run.truth, run.aligned)
    # By the clock of the ground truth: its poses stand here by the clock of the run.
    seconds = (run.truth.stamps - on.begin) / NANOSECONDS + run.time_offset_s
    ends = np.flatnonzero(gap_steps(run.aligned.stamps)) + 1
    rows = np.split(np.arange(len(run.aligned)), ends)
    spreads = {ABSOLUTE: _quantiles(errors)}
    for delta, unit in deltas:
        try:
            chosen = pairs(run.aligned, delta, unit)
        except TrajectoryError:
            continue  # the run's notes say it
        spreads[f"RPE over {delta:g} {unit}"] = _quantiles(relative_errors(run.truth, run.aligned, chosen))
    stretches = tuple(_stretch(run.aligned, errors, seconds, own, on) for own in rows if len(own))
    return DrawnRun(sequence, method, run.file, stretches, spreads)


def box(runs: Sequence[DrawnRun], measure: str, part: int) -> FloatArray | None:
    """(5,) the 5, 25, 50, 75 and 95 % quantiles of the errors of all runs, each run counting alike, or None.

    part: 0 for position (m), 1 for rotation (rad).
    """
    found = [run.spreads[measure][part] for run in runs if measure in run.spreads]
    return np.asarray(np.quantile(np.concatenate(found), _SHOWN)) if found else None


def _quantiles(errors: PoseErrors) -> FloatArray:
    return np.stack([np.quantile(each, _QUANTILES) for each in (errors.translation, errors.rotation)])


def _stretch(
    run: SpatialTrajectory, errors: PoseErrors, seconds: FloatArray, rows: npt.NDArray[np.intp], on: Ground
) -> Stretch:
    at = seconds[rows]
    bins = np.minimum(np.floor(at / max(on.duration_s, 1e-9) * _BINS), _BINS - 1)
    starts = np.flatnonzero(np.diff(bins, prepend=-np.inf))
    counts = np.diff(starts, append=len(rows))

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.add.reduceat(values, starts) / counts)

    return Stretch(
        begin_s=float(at[0]),
        end_s=float(at[-1]),
        path=simplified(run.positions[rows][:, on.axes[:2]], on.finest),
        times=mean(at),
        errors=np.sqrt(mean(errors.translation[rows] ** 2)),
        turns=np.sqrt(mean(errors.rotation[rows] ** 2)),
        third=mean(run.positions[rows, on.axes[2]]),
    )
