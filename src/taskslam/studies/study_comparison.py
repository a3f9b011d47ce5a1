"""The runs of one method against one another: precision and accuracy on frames that they share, and the verdict."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
import numpy.typing as npt
from scipy.special import stdtrit

from taskslam.evaluation.intervals import LEVEL, quantile, ratio_of
from taskslam.evaluation.trajectory_precision import frame_accuracy, frame_precision, published_frame_precision
from taskslam.geometry import FloatArray
from taskslam.record.trajectories import SpatialTrajectory
from taskslam.studies.study_results import (
    Beaten,
    ErrorStatistics,
    FrameSet,
    MethodSummary,
    OverRuns,
    PublishedPrecision,
    Ratio,
    RelativeOverRuns,
    RunResult,
    Verdict,
)


@dataclass(frozen=True)
class AlignedRun:
    """A run that could be evaluated: rows of `aligned`, `raw` and `truth` belong together."""

    aligned: SpatialTrajectory
    raw: SpatialTrajectory
    truth: SpatialTrajectory
    scale: float
    poses: int
    file: str
    notes: tuple[str, ...]
    stamps: npt.NDArray[np.int64]
    time_offset_s: float = 0.0


def common_set(runs: Sequence[AlignedRun], table: npt.NDArray[np.int64]) -> FrameSet:
    """Metrics over the frames that all runs have. table: (F, R) rows of each frame, see `common_frames`."""
    return _frame_set(runs, [table[(table >= 0).all(axis=1)]], len(table))


def shared_set(runs: Sequence[AlignedRun], table: npt.NDArray[np.int64]) -> FrameSet:
    """Metrics over the frames that at least two runs have, with the runs that have them."""
    return _frame_set(runs, _by_number_of_runs(table), len(table))


def _frame_set(runs: Sequence[AlignedRun], groups: Sequence[npt.NDArray[np.int64]], seen: int) -> FrameSet:
    """Metrics over frames in groups, each of frames that the same runs have: rows (F, R), -1 for a run without it."""
    precision: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    accuracy: list[tuple[FloatArray, FloatArray]] = []
    counts: list[int] = []
    for rows in groups:
        if not len(rows):
            continue
        having = np.flatnonzero(rows[0] >= 0)
        aligned, truth = ([(run.aligned, run.truth)[side] for run in runs] for side in (0, 1))
        positions, quaternions = _stack(aligned, rows, having)
        e = frame_accuracy(positions, quaternions, *_stack(truth, rows, having))
        accuracy.append((e.position, e.orientation))
        counts += [len(having)] * len(rows)
        if len(having) > 1:
            E = frame_precision(positions, quaternions)
            precision.append((E.position, E.orientation, E.position / math.sqrt(1 - 1 / len(having))))
    e_position, e_orientation = _joined(accuracy, 2)
    E_position, E_orientation, unbiased = _joined(precision, 3)
    return FrameSet(
        frames=len(counts),
        share=len(counts) / seen if seen else 0.0,
        runs=statistics.fmean(counts) if counts else 0.0,
        precision_m=_mean(E_position),
        precision_unbiased_m=_mean(unbiased),
        accuracy_m=_mean(e_position),
        precision_rad=_mean(E_orientation),
        accuracy_rad=_mean(e_orientation),
        precise=float(np.mean(unbiased < e_position)) if len(unbiased) == len(e_position) > 0 else None,
    )


def _by_number_of_runs(table: npt.NDArray[np.int64]) -> list[npt.NDArray[np.int64]]:
    """Frames that at least two runs have, grouped by which runs these are."""
    rows = table[(table >= 0).sum(axis=1) >= 2]
    patterns, group = np.unique(rows >= 0, axis=0, return_inverse=True)
    group = group.reshape(-1)
    order = np.argsort(group, kind="stable")
    ends = np.searchsorted(group[order], np.arange(1, len(patterns)))
    return list(np.split(rows[order], ends)) if len(rows) else []


def published_precision(runs: Sequence[AlignedRun], table: npt.NDArray[np.int64]) -> PublishedPrecision | None:
    """Over frames of all runs; the first run is then discarded, in both modes (protocol 5.8)."""
    rows = table[(table >= 0).all(axis=1)]
    if not len(rows):
        return None
    kept = list(range(1, len(runs)))
    lever = published_frame_precision(*_stack([run.aligned for run in runs], rows, kept))
    own = published_frame_precision(*_stack([run.raw for run in runs], rows, kept))
    return PublishedPrecision(
        lever_arm_m=float(lever.position.mean()),
        own_frames_m=float(own.position.mean()),
        orientation_rad=float(lever.orientation.mean()),
    )


def _stack(
    trajectories: Sequence[SpatialTrajectory],
    rows: npt.NDArray[np.int64],
    having: Sequence[int] | npt.NDArray[np.int64],
) -> tuple[FloatArray, FloatArray]:
    """(F, R, 3) positions and (F, R, 4) quaternions of the runs `having` at rows (F, all runs)."""
    return (
        np.stack([trajectories[run].positions[rows[:, run]] for run in having], axis=1),
        np.stack([trajectories[run].quaternions[rows[:, run]] for run in having], axis=1),
    )


def _joined(parts: Sequence[tuple[FloatArray, ...]], count: int) -> list[FloatArray]:
    return [np.concatenate([np.empty(0), *(part[index] for part in parts)]) for index in range(count)]


def _mean(values: FloatArray) -> float | None:
    return float(values.mean()) if len(values) else None


def accuracy_over_precision(
    runs: Sequence[AlignedRun],
    table: npt.NDArray[np.int64],
    frame_set: Callable[[Sequence[AlignedRun], npt.NDArray[np.int64]], FrameSet],
) -> tuple[Ratio | None, Ratio | None]:
    """Position and orientation. Frames of a run hang together, runs do not: so the jackknife leaves out runs."""
    values = _log_ratios(frame_set(runs, table))
    if values is None:
        return None, None
    halves = np.full(2, math.nan)
    if len(runs) >= 4:
        parts = []
        for left in range(len(runs)):
            rest = np.delete(table, left, axis=1)
            kept = [run for index, run in enumerate(runs) if index != left]
            parts.append(_log_ratios(frame_set(kept, rest[(rest >= 0).any(axis=1)])))
        if None not in parts:
            spread = np.std(np.array(parts), axis=0) * math.sqrt(len(runs) - 1)
            halves = float(stdtrit(len(runs) - 1, 0.975)) * spread
    position, orientation = (
        Ratio(
            value=math.exp(value),
            low=None if math.isnan(half) else math.exp(value - half),
            high=None if math.isnan(half) else math.exp(value + half),
        )
        for value, half in zip(values, halves, strict=True)
    )
    return position, orientation


def _log_ratios(frames: FrameSet) -> tuple[float, float] | None:
    E, unbiased, e = frames.precision_m, frames.precision_unbiased_m, frames.accuracy_m
    Delta, delta = frames.precision_rad, frames.accuracy_rad
    if not E or not unbiased or not e or not Delta or not delta:
        return None
    return math.log(e / unbiased), math.log(delta / (Delta * unbiased / E))


_FEWEST_RUNS = 3  # that give an interval
_PARTS = (attrgetter("translation_m"), attrgetter("rotation_rad"))


def over_runs(errors: Sequence[ErrorStatistics]) -> OverRuns | None:
    """The root mean squares of one kind of error, run by run."""
    if not errors or min(each.rmse for each in errors) <= 0:
        return None
    logs = np.log([each.rmse for each in errors])
    middle, half = float(logs.mean()), math.nan
    if len(logs) >= _FEWEST_RUNS:
        half = float(quantile(LEVEL, len(logs) - 1)) * float(logs.std(ddof=1)) / math.sqrt(len(logs))
    ends = [None if math.isnan(half) else ratio_of(middle + side * half) for side in (-1, 1)]
    return OverRuns(value=math.exp(middle), low=ends[0], high=ends[1])


def relative_over_runs(runs: Sequence[RunResult]) -> tuple[RelativeOverRuns, ...]:
    """RPE over each length, over the runs that go so far."""
    found = []
    for delta in dict.fromkeys(each.delta for run in runs for each in run.rpe):
        own = [each for run in runs for each in run.rpe if each.delta == delta]
        translation, rotation = (over_runs([part(each) for each in own]) for part in _PARTS)
        found.append(RelativeOverRuns(delta=delta, runs=len(own), translation_m=translation, rotation_rad=rotation))
    return tuple(found)


def verdict_of(results: Sequence[MethodSummary]) -> Verdict:
    """Over all results that have both precision and accuracy."""
    positions = [result.position for result in results if result.position is not None]
    orientations = [result.orientation for result in results if result.orientation is not None]
    return Verdict(compared=len(positions), position=_beaten(positions), orientation=_beaten(orientations))


def _beaten(ratios: Sequence[Ratio]) -> Beaten:
    return Beaten(
        results=sum(ratio.value > 1 for ratio in ratios),
        clearly=sum(ratio.low is not None and ratio.low > 1 for ratio in ratios),
        ratio=statistics.median(ratio.value for ratio in ratios) if ratios else None,
    )
