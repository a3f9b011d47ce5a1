"""`taskslam evaluate-trajectories`: recorded estimates against the ground truth and against one another."""

from __future__ import annotations

import math
import statistics
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from taskslam.cli.console import say, standard_output

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from taskslam.studies.run_names import Grouping
    from taskslam.studies.study_results import FrameSet, OpenLoopResults


def evaluate_trajectories(
    groundtruth: Annotated[
        str,
        typer.Argument(help="Ground truth of the runs that follow; or alone, a folder of sequences or a YAML file."),
    ],
    runs: Annotated[
        list[str] | None, typer.Argument(help="TUM, EuRoC csv or KITTI files, bags with a topic (FILE:TOPIC), folders.")
    ] = None,
    align: Annotated[
        str | None,
        typer.Option(
            help="What the method cannot observe: se3 (vision, default), sim3 (one camera), yaw (IMU), none; or origin."
        ),
    ] = None,
    times: Annotated[Path | None, typer.Option(help="Seconds of each pose, one a line: for KITTI files.")] = None,
    topic: Annotated[str | None, typer.Option(help="Topic of the runs that are bags and name none.")] = None,
    max_difference: Annotated[
        float | None, typer.Option(help="Seconds that associated stamps may differ (0.01).")
    ] = None,
    frame_tolerance: Annotated[
        float | None, typer.Option(help="Seconds within which stamps of two runs mean the same frame (0.001).")
    ] = None,
    time_unit: Annotated[
        str | None, typer.Option(help="Of stamps in text files: s, ms, us or ns; else told from them.")
    ] = None,
    time_offset: Annotated[
        str | None, typer.Option(help="Seconds to add to the stamps of runs, or auto: what gives the smallest ATE.")
    ] = None,
    one_method: Annotated[
        bool, typer.Option("--one-method", help="All runs are of one method, whatever names.")
    ] = False,
    apart: Annotated[bool, typer.Option("--apart", help="Every run is a method of its own.")] = False,
    rpe: Annotated[
        list[str] | None,
        typer.Option(help="Also relative errors over 1m, 5s, 30deg or 20frames, consecutive pairs; may be repeated."),
    ] = None,
    n_to_align: Annotated[
        int | None, typer.Option(min=1, help="Poses from the start that determine the alignment; else all.")
    ] = None,
    t_start: Annotated[float | None, typer.Option(help="Of the ground truth, nothing before (s).")] = None,
    t_end: Annotated[float | None, typer.Option(help="Of the ground truth, nothing after (s).")] = None,
    downsample: Annotated[int | None, typer.Option(min=1, help="Keep so many poses of each, evenly spaced.")] = None,
    plane: Annotated[str | None, typer.Option(help="Project both into xy, xz or yz after alignment.")] = None,
    body_sensor: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z,R,P,Y", help="Of the runs' sensor on the ground truth's body (m, rad)."),
    ] = None,
    floor_map: Annotated[
        Path | None,
        typer.Option("--map", help="A floor plan (map_server's YAML) in the frame of the ground truth, drawn below."),
    ] = None,
    poses: Annotated[
        bool, typer.Option("--poses", help="Also write aligned trajectories and the errors of each pose.")
    ] = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit status 1 if anything was left out or guessed: for build servers.")
    ] = False,
    upstream_compat: Annotated[
        bool, typer.Option("--upstream-compat", help="Also precision as the published code computes it.")
    ] = False,
    out: Annotated[Path, typer.Option(help="Folder for the page, the numbers and the figure.")] = Path("open_loop"),
) -> None:
    """Evaluate recorded trajectories: how accurate is each run, and how closely do the runs of a method agree?

    Writes the page report.html, open_loop.json, sequences.csv, runs.csv, table.tex, the figure precision_accuracy (PDF,
    SVG, PNG) and study.yaml, which repeats the evaluation, to OUT. A run that cannot be read is named and left out. A
    folder holds a folder for each sequence, with groundtruth.* in it and runs named METHOD_run0.tum, METHOD_run1.tum
    and so on; what a folder cannot say, a YAML file does (docs/trajectories.md).

    Examples:
        taskslam evaluate-trajectories groundtruth.tum orb_run0.tum orb_run1.tum orb_run2.tum

        taskslam evaluate-trajectories euroc --align yaw --out euroc_study

        taskslam evaluate-trajectories drive.bag:/groundtruth drive.bag:/odom --align none --rpe 1m

        taskslam evaluate-trajectories poses/00.txt results/00.txt --times sequences/00/times.txt
    """
    from taskslam.errors import InputError
    from taskslam.report.trajectories import evaluate_into
    from taskslam.studies.study import load_study
    from taskslam.studies.study_settings import Settings
    from taskslam.user_files import check

    said = {
        "align": align, "max_difference": max_difference, "frame_tolerance": frame_tolerance, "time_unit": time_unit,
        "time_offset": time_offset, "rpe": rpe or None, "n_to_align": n_to_align, "t_start": t_start, "t_end": t_end,
        "downsample": downsample, "plane": plane, "body_sensor": body_sensor,
        "upstream_compat": upstream_compat or None,
    }  # fmt: skip
    said = {name: value for name, value in said.items() if value is not None}
    check(Settings, said, "options", InputError)
    grouping = _grouping(one_method, apart)
    study = load_study(groundtruth, _with_topic(runs or [], topic), None if times is None else str(times), grouping)
    settings = check(Settings, {**study.settings.written(), **said}, "options", InputError)
    results, paths = evaluate_into(out, study if floor_map is None else study.on_map(str(floor_map)), settings, poses)
    console = standard_output()
    for name, sequence in study.sequences.items():
        counted = "; ".join(
            f"{len(files)} runs of {method}" for method, files in sequence.runs.items() if len(files) > 1
        )
        if counted:
            console.print(f"{name}: {counted} (--apart: each a method of its own).")
    _print_runs(console, results)
    _print_sequences(console, results)
    for left in results.left_out:
        say(f"Left out: {left.reason}", err=True)
    say(f"Written: {', '.join(str(path) for path in paths)}")
    if strict and not results.is_clean():
        say("Something was left out or guessed (--strict).", err=True)
        raise typer.Exit(1)


def _grouping(one_method: bool, apart: bool) -> Grouping:
    from taskslam.errors import InputError
    from taskslam.studies.run_names import Grouping

    if one_method and apart:
        raise InputError("--one-method and --apart contradict each other; expected one of them")
    return Grouping.ONE_METHOD if one_method else Grouping.APART if apart else Grouping.BY_NAME


def _with_topic(runs: list[str], topic: str | None) -> list[str]:
    from taskslam.datasets.bag_trajectories import is_bag
    from taskslam.datasets.trajectory_files import split_topic

    def named(run: str) -> str:
        path, own = split_topic(run)
        return f"{run}:{topic}" if topic and own is None and is_bag(path) else run

    return [named(run) for run in runs]


def _print_runs(console: Console, results: OpenLoopResults) -> None:
    """One row for each method on a sequence; every run is in runs.csv."""
    names = ["runs", "poses", "ATE cm", "from", "to", "rot. °"]
    table = _table("Runs against the ground truth", names)
    for result in results.results:
        ate = [run.ate_m.rmse for run in result.runs]
        row = [
            f"{len(ate)}",
            f"{statistics.median(run.poses for run in result.runs):.0f}",
            *(_cm(value) for value in (statistics.median(ate), min(ate), max(ate))),
            _degrees(statistics.median(run.rotation_rad.mean for run in result.runs)),
        ]
        table.add_row(result.sequence, result.method, *row)
    console.print(table)
    _print_relative(console, results)
    aligned = {
        method: [r.method for r in results.results if r.alignment is method]
        for method in dict.fromkeys(r.alignment for r in results.results)
    }
    how = "; ".join(f"{kind}: {', '.join(dict.fromkeys(who))}" for kind, who in aligned.items() if who)
    console.print(f"Medians over runs, of the root mean square (ATE, RPE) and of the mean angle. Aligned by {how}.")
    for name, notes in results.groundtruth_notes.items():
        for note in notes:
            console.print(f"  ground truth of {name}: {note}")
    for result in results.results:
        for run in result.runs:
            for note in run.notes:
                console.print(f"  {run.file}: {note}")


def _print_relative(console: Console, results: OpenLoopResults) -> None:
    """A row for each method and distance, where relative errors were asked for."""
    table = _table("Relative errors", ["over", "runs", "pairs", "RPE cm", "RPE °"])
    for result in results.results:
        for delta in dict.fromkeys(each.delta for run in result.runs for each in run.rpe):
            found = [each for run in result.runs for each in run.rpe if each.delta == delta]
            table.add_row(
                result.sequence,
                result.method,
                delta,
                f"{len(found)}",
                f"{statistics.median(each.pairs for each in found):.0f}",
                _cm(statistics.median(each.translation_m.rmse for each in found)),
                _degrees(statistics.median(each.rotation_rad.rmse for each in found)),
            )
    if table.row_count:
        console.print(table)


def _print_sequences(console: Console, results: OpenLoopResults) -> None:
    from taskslam.report.open_loop_words import cautions, verdict_sentence

    table = _table(
        "Runs of a method against one another", ["frames", "%", "E cm", "E∞ cm", "e cm", "E/D", "Δ °", "δ °", "Δ/FoV"]
    )
    for result in results.results:
        frames = result.compared_frames
        mark = "" if frames is result.common else "*"
        table.add_row(result.sequence, result.method + mark, f"{frames.frames}", f"{100 * frames.share:.0f}",
                      *_dual(frames, results))  # fmt: skip
    console.print(table)
    units = results.units
    console.print(
        "E, Δ: mean distance and angle of runs to their mean, frame by frame; E∞: corrected for their "
        "number; e, δ: to the ground truth. "
        f"D = {100 * units.robot_diameter:g} cm, FoV = {units.field_of_view:g}°. "
        "%: share of the frames that any run has."
    )
    for result in results.results:
        for sentence in cautions(result):
            console.print(sentence)
    if any(result.compared_frames is not result.common for result in results.results):
        console.print("* Hardly a frame is in all runs: these are the frames of at least two runs.")
    if any(result.published for result in results.results):
        table = _table("E as the published code has it, first run discarded", ["lever arm cm", "own frames cm"])
        for result in results.results:
            row = result.published
            table.add_row(result.sequence, result.method, _cm(row.lever_arm_m if row else None),
                          _cm(row.own_frames_m if row else None))  # fmt: skip
        console.print(table)
        console.print("Frames of all runs; lever arm: aligned; own frames: runs without map as they stand besides.")
    console.print(verdict_sentence(results))


def _dual(frames: FrameSet, results: OpenLoopResults) -> list[str]:
    units = results.units
    diameters = None if frames.precision_m is None else frames.precision_m / units.robot_diameter
    views = None if frames.precision_rad is None else math.degrees(frames.precision_rad) / units.field_of_view
    return [
        _cm(frames.precision_m),
        _cm(frames.precision_unbiased_m),
        _cm(frames.accuracy_m),
        "–" if diameters is None else f"{diameters:.2f}",
        _degrees(frames.precision_rad),
        _degrees(frames.accuracy_rad),
        "–" if views is None else f"{views:.3f}",
    ]


def _table(title: str, numbers: list[str]) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(
        title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0)
    )
    for name in ("sequence", "method"):
        table.add_column(name, overflow="fold")
    for name in numbers:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def _cm(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.2f}"


def _degrees(value: float | None) -> str:
    return "–" if value is None else f"{math.degrees(value):.2f}"
