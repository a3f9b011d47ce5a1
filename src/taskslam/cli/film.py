"""`taskslam film`: a finished run in the simulator as a film, or as a recording for the viewer rerun."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from taskslam.cli.console import say
from taskslam.cli.options import WorldPath


def film(
    run_dir: Annotated[Path, typer.Argument(metavar="RUN", help="A finished run in the simulator.")],
    out: Annotated[Path, typer.Option(help="The film, .mp4 or .gif; or .rrd, a recording for rerun of all rounds.")],
    round_: Annotated[str, typer.Option("--round", help="Round of the film, from 1, or priming.")] = "1",
    speed: Annotated[float, typer.Option(min=0.1, max=1000, help="Of the film, times the robot's own.")] = 8.0,
    height: Annotated[int, typer.Option(min=64, max=2160, help="Of the film's pictures, pixels.")] = 480,
    fps: Annotated[int, typer.Option(min=1, max=60, help="Frames a second of the film.")] = 30,
    world_path: WorldPath = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Film a tour: the world from above with robot and estimate, beside what the robot's stereo camera sees.

    For MP4 and GIF: pip install 'taskslam[film]'; for rerun: pip install 'taskslam[rerun]'.

    Examples:
        taskslam film results/house/karto/without-map/seed0 --out tour.mp4

        taskslam film results/house/karto/with-map/seed0 --out tour.gif --round priming --speed 20 --height 240 --fps 10

        taskslam film results/house/karto/without-map/seed0 --out tour.rrd
    """
    from taskslam.cli.progress import progress
    from taskslam.errors import InputError
    from taskslam.record import load_run
    from taskslam.report.film import Film, FilmSettings
    from taskslam.report.film_file import SUFFIXES, shipped_encoder, write_film
    from taskslam.report.relived import Eye, chosen_round, instants, relive
    from taskslam.report.rerun_file import SUFFIX, shipped_viewer, write_recording

    expected = (*SUFFIXES, SUFFIX)
    if out.suffix not in expected:
        raise InputError(f"--out {out}: expected a name that ends in {', '.join(expected[:-1])} or {SUFFIX}")
    shipped_viewer() if out.suffix == SUFFIX else shipped_encoder()
    record = load_run(run_dir)
    start = chosen_round(record, round_)
    instants(record, start, 1.0)  # before a world is loaded for nothing
    with progress(quiet) as observer:
        observer.run_begins(f"film of {run_dir}")
        relived = relive(record, world_path or [], observer)
        observer.stage("lighting the scene")
        if out.suffix == SUFFIX:
            eye = Eye(relived) if relived.robot.rig.stereo is not None else None
            write_recording(record, eye, out, observer.stage)
        else:
            name = "priming round" if start.priming else f"round {round_}"
            shown = Film(relived, start, name, FilmSettings(height, speed, fps))
            write_film(shown, out, fps, lambda number: observer.stage(f"frame {number} of {shown.count}"))
    if not quiet:
        say(f"{'Recording' if out.suffix == SUFFIX else 'Film'}: {out}")
