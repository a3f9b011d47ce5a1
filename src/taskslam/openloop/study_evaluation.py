"""An open-loop study, evaluated: every run against the ground truth, and the runs of a method against one another.

Each run is laid on the ground truth by the alignment that its method warrants, before anything is compared: runs live
in frames of their own. That takes from every run its best rigid fit, so it flatters accuracy at least as much as
precision: where precision still is the better, alignment is not why.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.special import stdtrit

from taskslam.errors import TrajectoryError
from taskslam.evaluation.trajectory_alignment import Alignment, align
from taskslam.evaluation.trajectory_association import DEFAULT_MAX_DIFFERENCE_NS, associate_trajectories, common_frames
from taskslam.evaluation.trajectory_errors import Statistics, absolute_errors, relative_errors
from taskslam.evaluation.trajectory_pairs import DeltaUnit, pairs
from taskslam.evaluation.trajectory_precision import frame_accuracy, frame_precision, published_frame_precision
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.openloop.study import SequenceRuns, Study
from taskslam.openloop.study_results import (
    FEW_FRAMES,
    Beaten,
    ErrorStatistics,
    FrameSet,
    LeftOutRun,
    MethodResult,
    OpenLoopResults,
    PublishedPrecision,
    Ratio,
    RelativeErrors,
    RunResult,
    Verdict,
)
from taskslam.openloop.trajectory_files import read_trajectory_file
from taskslam.record.trajectories import SpatialTrajectory


@dataclass(frozen=True)
class Settings:
    """How a study is evaluated. align: of methods that say nothing; rpe: over what, or no RPE at all."""

    align: Alignment = Alignment.SE3
    max_difference_ns: int = DEFAULT_MAX_DIFFERENCE_NS
    rpe: tuple[float, DeltaUnit] | None = None
    upstream_compat: bool = False


@dataclass(frozen=True)
class _Run:
    """A run that could be evaluated: rows of `aligned`, `raw` and `truth` belong together."""

    aligned: SpatialTrajectory
    raw: SpatialTrajectory
    truth: SpatialTrajectory
    scale: float
    poses: int
    file: str
    notes: tuple[str, ...]
    stamps: npt.NDArray[np.int64]


def evaluate_study(study: Study, settings: Settings) -> OpenLoopResults:
    """Evaluate all that can be; what cannot is named in `left_out`. Raises TrajectoryError if nothing can be."""
    results: list[MethodResult] = []
    left_out: list[LeftOutRun] = []
    frames: dict[str, int] = {}
    for name, sequence in study.sequences.items():
        try:
            truth = read_trajectory_file(sequence.groundtruth, _path(sequence.times)).trajectory
        except TrajectoryError as error:
            left_out.append(LeftOutRun(sequence=name, method=None, file=sequence.groundtruth, reason=str(error)))
            continue
        runs = {
            method: _read_runs(
                name, method, sequence, truth, study.alignment(method, settings.align), settings, left_out
            )
            for method in sequence.runs
        }
        seen = len(common_frames([run.stamps for method in runs.values() for run in method]))
        frames[name] = sequence.frames or seen
        results += [
            _method_result(name, method, study.alignment(method, settings.align), found, frames[name], truth, settings)
            for method, found in runs.items()
            if found
        ]
    if not results:
        reasons = "; ".join(left.reason for left in left_out[:3]) or "the study names no run"
        raise TrajectoryError(f"nothing can be evaluated: {reasons}")
    return OpenLoopResults(
        units=study.units,
        max_difference_s=settings.max_difference_ns / NANOSECONDS,
        frames=frames,
        counted={name: study.sequences[name].frames is not None for name in frames},
        results=tuple(results),
        verdict=_verdict(results),
        left_out=tuple(left_out),
    )


def _read_runs(
    name: str,
    method: str,
    sequence: SequenceRuns,
    truth: SpatialTrajectory,
    alignment: Alignment,
    settings: Settings,
    left_out: list[LeftOutRun],
) -> list[_Run]:
    runs = []
    for file in sequence.runs[method]:
        try:
            read = read_trajectory_file(file, _path(sequence.times))
            matched, estimate = associate_trajectories(truth, read.trajectory, settings.max_difference_ns)
            similarity = align(estimate, matched, alignment)
        except TrajectoryError as error:
            reason = str(error) if file.partition(":")[0] in str(error) else f"{file}: {error}"
            left_out.append(LeftOutRun(sequence=name, method=method, file=file, reason=reason))
            continue
        runs.append(
            _Run(similarity.apply(estimate), estimate, matched, similarity.scale, len(read.trajectory), file,
                 read.notes, read.trajectory.stamps)
        )  # fmt: skip
    return runs


def _method_result(
    sequence: str,
    method: str,
    alignment: Alignment,
    runs: Sequence[_Run],
    frames: int,
    truth: SpatialTrajectory,
    settings: Settings,
) -> MethodResult:
    table = common_frames([run.aligned.stamps for run in runs])
    common, shared = _common(runs, table), _shared(runs, table)
    position, orientation = _ratios(runs, table, _common if common.share >= FEW_FRAMES else _shared)
    return MethodResult(
        sequence=sequence,
        method=method,
        alignment=alignment,
        runs=tuple(_run_result(run, frames, truth, settings) for run in runs),
        common=common,
        shared=shared,
        position=position,
        orientation=orientation,
        published=_published(runs, table) if settings.upstream_compat and len(runs) > 2 else None,
    )


def _run_result(run: _Run, frames: int, truth: SpatialTrajectory, settings: Settings) -> RunResult:
    errors = absolute_errors(run.truth, run.aligned)
    duration = truth.stamps[-1] - truth.stamps[0]
    covered = run.aligned.stamps[-1] - run.aligned.stamps[0]
    rpe, notes = None, run.notes
    if settings.rpe is not None:
        try:
            chosen = pairs(run.aligned, *settings.rpe)
            relative = relative_errors(run.truth, run.aligned, chosen)
            rpe = RelativeErrors(
                delta=f"{settings.rpe[0]:g} {settings.rpe[1]}",
                pairs=len(chosen.first),
                translation_m=_statistics(relative.translation),
                rotation_rad=_statistics(relative.rotation),
            )
        except TrajectoryError as error:
            notes += (str(error),)
    return RunResult(
        file=run.file,
        poses=run.poses,
        associated=len(run.aligned),
        completeness=run.poses / frames,
        time_covered=float(min(covered / duration, 1.0)) if duration > 0 else 1.0,
        scale=run.scale,
        ate_m=_statistics(errors.translation),
        rotation_rad=_statistics(errors.rotation),
        rpe=rpe,
        notes=notes,
    )


def _frame_set(runs: Sequence[_Run], groups: Sequence[npt.NDArray[np.int64]], seen: int) -> FrameSet:
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


def _common(runs: Sequence[_Run], table: npt.NDArray[np.int64]) -> FrameSet:
    return _frame_set(runs, [table[(table >= 0).all(axis=1)]], len(table))


def _shared(runs: Sequence[_Run], table: npt.NDArray[np.int64]) -> FrameSet:
    return _frame_set(runs, _by_number_of_runs(table), len(table))


def _by_number_of_runs(table: npt.NDArray[np.int64]) -> list[npt.NDArray[np.int64]]:
    """Frames that at least two runs have, grouped by which runs these are."""
    rows = table[(table >= 0).sum(axis=1) >= 2]
    patterns, group = np.unique(rows >= 0, axis=0, return_inverse=True)
    group = group.reshape(-1)
    order = np.argsort(group, kind="stable")
    ends = np.searchsorted(group[order], np.arange(1, len(patterns)))
    return list(np.split(rows[order], ends)) if len(rows) else []


def _published(runs: Sequence[_Run], table: npt.NDArray[np.int64]) -> PublishedPrecision | None:
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


def _statistics(errors: FloatArray) -> ErrorStatistics:
    return ErrorStatistics(**asdict(Statistics.of(errors)))


def _ratios(
    runs: Sequence[_Run],
    table: npt.NDArray[np.int64],
    frame_set: Callable[[Sequence[_Run], npt.NDArray[np.int64]], FrameSet],
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


def _verdict(results: Sequence[MethodResult]) -> Verdict:
    positions = [result.position for result in results if result.position is not None]
    orientations = [result.orientation for result in results if result.orientation is not None]
    return Verdict(compared=len(positions), position=_beaten(positions), orientation=_beaten(orientations))


def _beaten(ratios: Sequence[Ratio]) -> Beaten:
    return Beaten(
        results=sum(ratio.value > 1 for ratio in ratios),
        clearly=sum(ratio.low is not None and ratio.low > 1 for ratio in ratios),
        ratio=statistics.median(ratio.value for ratio in ratios) if ratios else None,
    )


def _path(name: str | None) -> Path | None:
    return None if name is None else Path(name)
