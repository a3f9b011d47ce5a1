"""An open-loop study, evaluated: every run against the ground truth, and the runs of a method against one another.

Each run is laid on the ground truth by the alignment that its method warrants, before anything is compared: runs live
in frames of their own. That takes from every run its best rigid fit, so it flatters accuracy at least as much as
precision: where precision still is the better, alignment is not why.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

from taskslam.datasets.trajectory_files import read_trajectory_file
from taskslam.errors import TrajectoryError
from taskslam.evaluation.trajectory_alignment import Alignment, align, noise_about_a_line
from taskslam.evaluation.trajectory_association import associate_trajectories, common_frames
from taskslam.evaluation.trajectory_errors import Statistics, absolute_errors, relative_errors
from taskslam.evaluation.trajectory_pairs import pairs
from taskslam.evaluation.trajectory_timing import find_time_offset, gaps_of
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.record.trajectories import SpatialTrajectory
from taskslam.studies.run_comparability import at_common_times, diverged
from taskslam.studies.study import SequenceRuns, Study
from taskslam.studies.study_comparison import (
    AlignedRun,
    accuracy_over_precision,
    common_set,
    over_runs,
    published_precision,
    relative_over_runs,
    shared_set,
    verdict_of,
)
from taskslam.studies.study_results import (
    FEW_FRAMES,
    ErrorStatistics,
    LeftOutRun,
    MethodSummary,
    OpenLoopResults,
    RelativeErrors,
    RunResult,
)
from taskslam.studies.study_settings import Settings

_CLEARLY = 2.0  # times an ATE, that a shift in time must save before it is spoken of
_SHORTEST_S = 1e-3


Keep = Callable[[str, str, AlignedRun, SpatialTrajectory], None]


def evaluate_study(study: Study, settings: Settings, keep: Keep = lambda *_: None) -> OpenLoopResults:
    """Evaluate all that can be; what cannot is named in `left_out`. Raises TrajectoryError if nothing can be.

    keep: told of each run's sequence and method, of the run as it was laid on the ground truth, and of all the latter.
    """
    results: list[MethodSummary] = []
    left_out: list[LeftOutRun] = []
    frames: dict[str, int] = {}
    notes: dict[str, tuple[str, ...]] = {}
    for name, sequence in study.sequences.items():
        try:
            read = read_trajectory_file(sequence.groundtruth, _path(sequence.times))
        except TrajectoryError as error:
            left_out.append(LeftOutRun(sequence=name, method=None, file=sequence.groundtruth, reason=str(error)))
            continue
        try:
            truth, notes[name] = settings.preparation.of_truth(read.trajectory), read.notes
        except TrajectoryError as error:
            reason = f"{sequence.groundtruth}: {error}"
            left_out.append(LeftOutRun(sequence=name, method=None, file=sequence.groundtruth, reason=reason))
            continue
        runs = {
            method: _read_runs(
                name, method, sequence, truth, study.alignment(method, settings.align), settings, left_out
            )
            for method in sequence.runs
        }
        whole = settings.preparation.projected(truth)
        for method, found in runs.items():
            for run in found:
                keep(name, method, run, whole)
        stamps = [run.stamps for method in runs.values() for run in method]
        seen = len(common_frames(stamps, settings.frame_tolerance_ns))
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
        max_difference_s=settings.max_difference,
        frames=frames,
        groundtruth_notes={name: said for name, said in notes.items() if said},
        counted={name: study.sequences[name].frames is not None for name in frames},
        results=tuple(results),
        verdict=verdict_of(results),
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
) -> list[AlignedRun]:
    runs = []
    for file in sequence.runs[method]:
        try:
            read = read_trajectory_file(file, _path(sequence.times), settings.stamp_unit, truth)
            own = settings.preparation.of_run(read.trajectory)
            clock, offset, notes = _by_the_clock_of(truth, own, alignment, settings)
            matched, estimate = associate_trajectories(clock, own, settings.max_difference_ns)
            similarity = align(estimate, matched, alignment, settings.n_to_align)
            aligned = similarity.apply(estimate)
            notes = read.notes + notes + _open_rotation(aligned, matched, alignment)
            aligned, matched = settings.preparation.projected(aligned), settings.preparation.projected(matched)
        except TrajectoryError as error:
            reason = str(error) if file.partition(":")[0] in str(error) else f"{file}: {error}"
            left_out.append(LeftOutRun(sequence=name, method=method, file=file, reason=reason))
            continue
        runs.append(
            AlignedRun(aligned, estimate, matched, similarity.scale, len(read.trajectory), file, notes,
                       read.trajectory.stamps, offset)
        )  # fmt: skip
    return runs


def _by_the_clock_of(
    truth: SpatialTrajectory, run: SpatialTrajectory, alignment: Alignment, settings: Settings
) -> tuple[SpatialTrajectory, float, tuple[str, ...]]:
    """The ground truth by the clock of the run, the seconds that this adds to the run's stamps, and what is to be said.

    It is the ground truth that is shifted, so that runs of one drive keep the stamps that they share.
    """
    if settings.time_offset == "auto":
        apart = run.stamps[0] > truth.stamps[-1] or run.stamps[-1] < truth.stamps[0]
        start = float(truth.stamps[0] - run.stamps[0]) / NANOSECONDS if apart else 0.0
        found = find_time_offset(truth, run, alignment, start)
        if found is None:
            raise TrajectoryError("no time offset can be found; expected a longer run, or --time-offset SECONDS")
        offset = found.seconds
        notes: tuple[str, ...] = (f"{offset:.3f} s were added to its stamps (--time-offset auto)",)
    else:
        offset, notes = settings.time_offset, ()
        found = find_time_offset(truth, run, alignment, offset)
        better = found is not None and _CLEARLY * found.rmse_shifted < found.rmse
        if found is not None and better and abs(found.seconds - offset) > _SHORTEST_S:
            ates = f"{100 * found.rmse_shifted:.2f} cm instead of {100 * found.rmse:.2f} cm"
            notes = (f"its clock may be off: with --time-offset {found.seconds:.3f} its ATE would be {ates}",)
    shifted = truth.stamps - round(offset * NANOSECONDS)
    return SpatialTrajectory(shifted, truth.positions, truth.quaternions), offset, notes


def _open_rotation(aligned: SpatialTrajectory, matched: SpatialTrajectory, kind: Alignment) -> tuple[str, ...]:
    found = noise_about_a_line(aligned, matched) if kind in (Alignment.SE3, Alignment.SIM3) else None
    if found is None:
        return ()
    across, noise = (f"{100 * value:.2g} cm" for value in found)
    sentence = (
        f"it drove along a line ({across} across, errors of {noise}): its turn about that line, and so its rotation "
        "errors, rest on errors of position; --align yaw or none leaves them out"
    )
    return (sentence,)


def _method_result(
    sequence: str,
    method: str,
    alignment: Alignment,
    runs: Sequence[AlignedRun],
    frames: int,
    truth: SpatialTrajectory,
    settings: Settings,
) -> MethodSummary:
    judged = tuple(_run_result(run, frames, truth, settings) for run in runs)
    table = common_frames([run.aligned.stamps for run in runs], settings.frame_tolerance_ns)
    interpolated = len(runs) > 1 and shared_set(runs, table).share < FEW_FRAMES
    if interpolated:
        runs, table = at_common_times(runs)
    common, shared = common_set(runs, table), shared_set(runs, table)
    frame_set = common_set if common.share >= FEW_FRAMES else shared_set
    position, orientation = accuracy_over_precision(runs, table, frame_set)
    far = diverged([run.ate_m.rmse for run in judged])
    kept = [run for run in range(len(runs)) if run not in far]
    rest = table[:, kept]
    return MethodSummary(
        sequence=sequence,
        method=method,
        alignment=alignment,
        runs=judged,
        ate_m=over_runs([run.ate_m for run in judged]),
        rotation_rad=over_runs([run.rotation_rad for run in judged]),
        rpe=relative_over_runs(judged),
        common=common,
        shared=shared,
        position=position,
        orientation=orientation,
        published=published_precision(runs, table) if settings.upstream_compat and len(runs) > 2 else None,
        interpolated=interpolated,
        diverged=tuple(runs[run].file for run in far),
        without_diverged=(frame_set([runs[run] for run in kept], rest[(rest >= 0).any(axis=1)]) if far else None),
    )


def _run_result(run: AlignedRun, frames: int, truth: SpatialTrajectory, settings: Settings) -> RunResult:
    errors = absolute_errors(run.truth, run.aligned)
    duration = float(truth.stamps[-1] - truth.stamps[0]) / NANOSECONDS
    gaps = gaps_of(run.aligned.stamps)
    covered = float(run.aligned.stamps[-1] - run.aligned.stamps[0]) / NANOSECONDS - gaps.seconds
    time_covered = min(covered / duration, 1.0) if duration > 0 else 1.0
    rpe: list[RelativeErrors] = []
    notes = run.notes
    for delta, unit in settings.deltas:
        try:
            chosen = pairs(run.aligned, delta, unit)
            relative = relative_errors(run.truth, run.aligned, chosen)
            rpe.append(
                RelativeErrors(
                    delta=f"{delta:g} {unit}",
                    pairs=len(chosen.first),
                    translation_m=_statistics(relative.translation),
                    rotation_rad=_statistics(relative.rotation),
                )
            )
        except TrajectoryError as error:
            notes += (str(error),)
    return RunResult(
        file=run.file,
        poses=run.poses,
        associated=len(run.aligned),
        completeness=run.poses / frames if run.poses <= frames else time_covered,
        time_covered=time_covered,
        gaps=gaps.count,
        longest_gap_s=gaps.longest_s,
        time_offset_s=run.time_offset_s,
        scale=run.scale,
        ate_m=_statistics(errors.translation),
        rotation_rad=_statistics(errors.rotation),
        rpe=tuple(rpe),
        notes=notes,
    )


def _statistics(errors: FloatArray) -> ErrorStatistics:
    return ErrorStatistics(**asdict(Statistics.of(errors)))


def _path(name: str | None) -> Path | None:
    return None if name is None else Path(name)
