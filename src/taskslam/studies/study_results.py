"""What an open-loop study found, as numbers: open_loop.json, and tables for spreadsheets. Undefined is null.

Lengths are metres, angles radians. Field by field in docs/trajectories.md.
"""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict

from taskslam.evaluation.trajectory_alignment import Alignment
from taskslam.files import write_whole
from taskslam.printable import printable
from taskslam.studies.study import StudyUnits

FEW_FRAMES = 0.1  # of all frames that any run of the method has

OPEN_LOOP_FORMAT: Literal["taskslam-open-loop/2"] = "taskslam-open-loop/2"


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class ErrorStatistics(_Part):
    """Of one kind of error over the poses of a run."""

    rmse: float
    mean: float
    median: float
    std: float
    min: float
    max: float


class RelativeErrors(_Part):
    """RPE over `delta` (such as `1 m`), consecutive pairs."""

    delta: str
    pairs: int
    translation_m: ErrorStatistics
    rotation_rad: ErrorStatistics


class RunResult(_Part):
    """One run against the ground truth, after alignment (scale: of Sim(3), else 1).

    associated: poses that have one of the ground truth; completeness: poses over frames of the sequence, or
    time_covered where there are more poses than frames; time_covered: from first to last associated pose without the
    gaps between them, as a share of the ground truth's time; time_offset_s: what was added to its stamps.
    """

    file: str
    poses: int
    associated: int
    completeness: float
    time_covered: float
    scale: float
    ate_m: ErrorStatistics
    rotation_rad: ErrorStatistics
    rpe: tuple[RelativeErrors, ...] = ()
    notes: tuple[str, ...] = ()
    gaps: int = 0
    longest_gap_s: float = 0.0
    time_offset_s: float = 0.0


class FrameSet(_Part):
    """Precision and accuracy over a set of frames: means over frames of means over runs.

    frames: how many; share: of all frames that any run has; runs: mean number of runs a frame has; precision_m is E of
    as many runs as there are, precision_unbiased_m that of ever more (E over sqrt(1 - 1/R), frame by frame); precise:
    share of frames whose unbiased E is smaller than e.
    """

    frames: int
    share: float
    runs: float
    precision_m: float | None
    precision_unbiased_m: float | None
    accuracy_m: float | None
    precision_rad: float | None
    accuracy_rad: float | None
    precise: float | None


class PublishedPrecision(_Part):
    """What the published code makes of the same frames, its first run discarded (protocol 5.8, 5.9 h, i).

    lever_arm: aligned runs, but the lever arm in the formula; own_frames: the runs as they stand besides, not aligned.
    """

    lever_arm_m: float
    own_frames_m: float
    orientation_rad: float


class Ratio(_Part):
    """Accuracy over precision, the latter corrected for the number of runs; above 1 precision is the better.

    low, high: 95 % interval by the jackknife over runs (each left out in turn), of the logarithm; null below four runs.
    """

    value: float
    low: float | None
    high: float | None


class OverRuns(_Part):
    """A root mean square error over the runs of a method: their geometric mean, which is that of a typical run.

    low, high: 95 % interval, Student's t over the logarithms of the runs; null below three runs.
    """

    value: float
    low: float | None
    high: float | None


class RelativeOverRuns(_Part):
    """RPE over `delta`, over the runs that go so far."""

    delta: str
    runs: int
    translation_m: OverRuns | None
    rotation_rad: OverRuns | None


class MethodSummary(_Part):
    """One method on one sequence. common: frames that all runs have; shared: frames that at least two runs have.

    ate_m, rotation_rad, rpe: root mean squares over the runs, null where an error is nothing.

    position, orientation: e over E and delta over Delta on `compared_frames`; interpolated: the runs share no stamps,
    and are compared at those of the one with fewest poses; diverged: files of runs so far off that they alone decide
    what is said; without_diverged: the compared frames of the others.
    """

    sequence: str
    method: str
    alignment: Alignment
    runs: tuple[RunResult, ...]
    ate_m: OverRuns | None
    rotation_rad: OverRuns | None
    rpe: tuple[RelativeOverRuns, ...]
    common: FrameSet
    shared: FrameSet
    position: Ratio | None
    orientation: Ratio | None
    published: PublishedPrecision | None = None
    interpolated: bool = False
    diverged: tuple[str, ...] = ()
    without_diverged: FrameSet | None = None

    @property
    def compared_frames(self) -> FrameSet:
        """The frames that the figure and the verdict take: those of all runs, or of two or more if those are few.

        A method that answers for keyframes alone chooses others in every run, so that hardly one is in all of them.
        """
        return self.common if self.common.share >= FEW_FRAMES else self.shared


class LeftOutRun(_Part):
    """What could not be evaluated, and why."""

    sequence: str
    method: str | None
    file: str
    reason: str


class Beaten(_Part):
    """On how many results accuracy is larger than precision; how many of them clearly (interval above 1); by how much.

    ratio: the median of `Ratio.value`.
    """

    results: int
    clearly: int
    ratio: float | None


class Verdict(_Part):
    """Whether precision beats accuracy, over the results that have both.

    Errors that are independent from run to run would make the ratios 1, whatever their size; a bias that all runs share
    raises them.
    """

    compared: int
    position: Beaten
    orientation: Beaten


class OpenLoopResults(_Part):
    """The content of open_loop.json. frames: of each sequence; counted: said by the study, not seen in the runs.

    groundtruth_notes: what was left out of a sequence's ground truth, or guessed.
    """

    format: Literal["taskslam-open-loop/2"] = OPEN_LOOP_FORMAT
    units: StudyUnits
    max_difference_s: float
    frames: dict[str, int]
    counted: dict[str, bool]
    results: tuple[MethodSummary, ...]
    verdict: Verdict
    left_out: tuple[LeftOutRun, ...] = ()
    groundtruth_notes: dict[str, tuple[str, ...]] = {}

    def is_clean(self) -> bool:
        """Whether nothing was left out or guessed, and no run diverged."""
        runs = [run for result in self.results for run in result.runs]
        odd = any(result.diverged or result.interpolated for result in self.results)
        return not (self.left_out or self.groundtruth_notes or odd or any(run.notes for run in runs))


def write_results(folder: Path, results: OpenLoopResults) -> list[Path]:
    """Write open_loop.json, sequences.csv and runs.csv; returns their paths. Raises DiskFullError."""
    contents = {
        "open_loop.json": results.model_dump_json(indent=2) + "\n",
        "sequences.csv": _table([_sequence_row(result, results.units) for result in results.results]),
        "runs.csv": _table([_run_row(result, run) for result in results.results for run in result.runs]),
    }
    for name, text in contents.items():
        write_whole(folder / name, printable(text))
    return [folder / name for name in contents]


def _sequence_row(result: MethodSummary, units: StudyUnits) -> dict[str, object]:
    row: dict[str, object] = {
        "sequence": result.sequence, "method": result.method, "alignment": result.alignment.value,
        "runs": len(result.runs),
    }  # fmt: skip
    for name, ratio in (("position", result.position), ("orientation", result.orientation)):
        row |= {f"{name}_ratio": ratio and ratio.value, f"{name}_ratio_low": ratio and ratio.low}
    for name, frames in (("common", result.common), ("shared", result.shared)):
        row |= {f"{name}_{key}": value for key, value in frames.model_dump().items()}
    for name, value in (("precision", result.common.precision_m), ("accuracy", result.common.accuracy_m)):
        row[f"common_{name}_D"] = None if value is None else value / units.robot_diameter
    for name, value in (("precision", result.common.precision_rad), ("accuracy", result.common.accuracy_rad)):
        row[f"common_{name}_FoV"] = None if value is None else math.degrees(value) / units.field_of_view
    if result.published is not None:
        row |= {f"published_{key}": value for key, value in result.published.model_dump().items()}
    return row


def _run_row(result: MethodSummary, run: RunResult) -> dict[str, object]:
    row: dict[str, object] = {"sequence": result.sequence, "method": result.method, "alignment": result.alignment.value}
    row |= run.model_dump(
        include={
            "file",
            "poses",
            "associated",
            "completeness",
            "time_covered",
            "gaps",
            "longest_gap_s",
            "time_offset_s",
            "scale",
        }
    )
    row |= {f"ate_{name}_m": value for name, value in run.ate_m.model_dump().items()}
    row |= {f"rotation_{name}_rad": value for name, value in run.rotation_rad.model_dump().items()}
    for each in run.rpe:
        name = f"rpe_{each.delta.replace(' ', '')}"
        row |= {f"{name}_pairs": each.pairs, f"{name}_rmse_m": each.translation_m.rmse,
                f"{name}_rmse_rad": each.rotation_rad.rmse}  # fmt: skip
    return row | {"notes": "; ".join(run.notes)}


def _table(rows: list[dict[str, object]]) -> str:
    """CSV with a header; empty cells are undefined."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(dict.fromkeys(name for row in rows for name in row)), lineterminator="\n")
    if rows:
        writer.writeheader()
        writer.writerows(rows)
    return text.getvalue()
