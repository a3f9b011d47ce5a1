"""All that an evaluation of recorded trajectories leaves: numbers, tables, figure, page, and the study itself."""

from __future__ import annotations

from pathlib import Path

from taskslam.evaluation.trajectory_preparation import Plane
from taskslam.files import write_whole, writing
from taskslam.printable import printable
from taskslam.record.trajectories import SpatialTrajectory
from taskslam.report.drawn_run import DrawnRun, Ground, drawn_run, ground
from taskslam.report.figures.open_loop import open_loop_figure
from taskslam.report.figures.style import FORMATS, save_figure
from taskslam.report.page.trajectory_page import Drawn, write_trajectory_page
from taskslam.report.tables.open_loop_latex import open_loop_latex
from taskslam.studies.study import Study, dump_study
from taskslam.studies.study_comparison import AlignedRun
from taskslam.studies.study_evaluation import evaluate_study
from taskslam.studies.study_results import OpenLoopResults, write_results
from taskslam.studies.study_settings import Settings
from taskslam.studies.written_poses import write_poses
from taskslam.world import FloorPlan
from taskslam.world.map_server import load_floor_plan


def evaluate_into(
    out: Path, study: Study, settings: Settings, poses: bool = False
) -> tuple[OpenLoopResults, list[Path]]:
    """Evaluate a study and write all of it into a folder, which is made; returns the results and the paths.

    poses: also each run as it was aligned and the errors of its poses. study.yaml repeats the evaluation.

    Raises TrajectoryError, FloorPlanError (a map of the study), DiskFullError, RecordError (no place for the folder).
    """
    plans = {name: _plan(sequence.map) for name, sequence in study.sequences.items()}
    grounds: dict[str, Ground] = {}
    runs: dict[str, list[DrawnRun]] = {}
    written: list[Path] = []
    with writing(out):
        out.mkdir(parents=True, exist_ok=True)

    def keep(sequence: str, method: str, run: AlignedRun, truth: SpatialTrajectory) -> None:
        if sequence not in grounds:
            level = plans[sequence] is not None or settings.plane is Plane.XY
            grounds[sequence] = ground(truth, level)
        on = grounds[sequence]
        runs.setdefault(sequence, []).append(drawn_run(sequence, method, run, on, settings.deltas))
        if poses:
            written.extend(write_poses(out, sequence, method, run))

    results = evaluate_study(study, settings, keep)
    written = [*write_results(out, results), *written]
    tables = {"study.yaml": dump_study(study, settings, out), "table.tex": open_loop_latex(results)}
    for name, text in tables.items():
        write_whole(out / name, printable(text))
    written += [out / name for name in tables]
    if any(result.compared_frames.precision_m is not None for result in results.results):
        written += save_figure(open_loop_figure(results, "page"), out, "precision_accuracy", FORMATS)
    drawn = {name: Drawn(on, tuple(runs[name]), plans[name]) for name, on in grounds.items()}
    written.append(write_trajectory_page(out / "report.html", settings, results, drawn))
    return results, written


def _plan(map_file: str | None) -> FloorPlan | None:
    return None if map_file is None else load_floor_plan(Path(map_file))
