"""`taskslam camera`: print a board, calibrate a camera, record at a waypoint."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from taskslam.cli.console import say

app = typer.Typer(help="Cameras: calibrate one, and record the arrivals that it sees.", no_args_is_help=True)


@app.command()
def board(
    kind: Annotated[str, typer.Option(help="charuco (better) or aprilgrid.")] = "charuco",
    grid: Annotated[str, typer.Option(metavar="COLUMNSxROWS", help="Squares or tags.")] = "8x6",
    size: Annotated[
        float | None, typer.Option(metavar="MM", help="Side of a square or tag; by default the largest that fits.")
    ] = None,
    paper: Annotated[str, typer.Option(help="A4, A3, Letter or WIDTHxHEIGHT in mm.")] = "A4",
    out: Annotated[Path, typer.Option("--out", "-o", help="The PDF to write.")] = Path("board.pdf"),
) -> None:
    """Write a calibration board as a vector PDF in exact millimetres.

    Example: `taskslam camera board --paper A3 --out board.pdf`
    """
    from taskslam.errors import InputError
    from taskslam.files import write_whole
    from taskslam.realworld.cameras.boards import board_page, largest_board, parse_board
    from taskslam.realworld.tags.pdf import write_pdf
    from taskslam.realworld.tags.tag_sheets import paper_size

    columns, _, rows = grid.lower().partition("x")
    if not (columns.isdecimal() and rows.isdecimal() and len(grid) < 9):
        raise InputError(f"--grid {grid}: expected COLUMNSxROWS, such as 8x6")
    sheet = paper_size(paper)
    made = parse_board(f"{kind}:{grid}:{size:g}") if size else largest_board(kind, int(columns), int(rows), sheet)
    write_whole(out, write_pdf([board_page(made, sheet)], f"Calibration board {made.spec}"))
    say(f"{out}: {made.spec}; print at 100 %, then: taskslam camera calibrate IMAGES --board {made.spec}")


@app.command()
def calibrate(
    images: Annotated[
        list[Path], typer.Argument(metavar="IMAGES|VIDEO", help="Pictures, folders of pictures, or videos.")
    ],
    board: Annotated[str, typer.Option(help="The board, as its footer says: charuco:8x6:29 or aprilgrid:5x4:36 (mm).")],
    model: Annotated[
        str, typer.Option(help="plumb_bob, rational_polynomial (wide angle) or equidistant (fisheye).")
    ] = "plumb_bob",
    name: Annotated[str, typer.Option(help="The camera's name.")] = "camera",
    out: Annotated[Path, typer.Option("--out", "-o", help="The ROS camera_info YAML to write.")] = Path("camera.yaml"),
    page: Annotated[Path | None, typer.Option(help="The page with pictures; by default beside the YAML file.")] = None,
) -> None:
    """Calibrate a camera from views of a board: ROS camera_info YAML, and a page that shows how good it is.

    Fix focus and resolution first. Show the board in 20 to 40 pictures: near, at every edge of the image, tilted by 20
    to 40° in all directions, standing still. Views that disagree with the rest are left out and named.

    Example: `taskslam camera calibrate pictures/ --board charuco:8x6:29 --name east --out east.yaml`
    """
    from taskslam.errors import InputError, did_you_mean
    from taskslam.realworld.cameras.boards import parse_board
    from taskslam.realworld.cameras.calibration_guidance import guidance
    from taskslam.realworld.cameras.calibration_images import calibrate_from, collect_views
    from taskslam.realworld.cameras.camera_files import save_camera
    from taskslam.realworld.cameras.camera_model import DistortionModel
    from taskslam.report.page.calibration_page import write_calibration_page

    if model not in list(DistortionModel):
        known = ", ".join(DistortionModel)
        raise InputError(f"--model {model}: expected {known}.{did_you_mean(model, DistortionModel)}")
    seen = parse_board(board)
    collected = collect_views(images, seen)
    for refused, reason in collected.refused:
        say(f"not used  {refused}: {reason}", err=True)
    result = calibrate_from(collected, seen, name, DistortionModel(model))
    for fitted in result.dropped:
        say(f"left out  {fitted.view.name}: {fitted.rms:.2f} px, disagrees with the rest", err=True)
    save_camera(out, result.camera)
    page = page or out.with_suffix(".html")
    write_calibration_page(result, collected.refused, seen.spec, str(out), page)
    width, height = collected.size
    say(f"{name}: {width} x {height} px, {len(result.used)} views, reprojection error {result.rms:.3f} px")
    for parameter, value, deviation in result.parameters:
        digits = 2 if parameter[0] in "fc" else 5
        say(f"  {parameter:<3} {value:>10.{digits}f} ± {deviation:.{digits}f}")
    for sentence in guidance(result):
        say(f"  ! {sentence}")
    say(f"{out}, {page}")


@app.command()
def record(
    source: Annotated[
        str, typer.Argument(metavar="SOURCE", help="A camera's index (0), a stream's URL (rtsp, http) or a video file.")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the pictures; an earlier one is continued.")],
    ids: Annotated[str, typer.Option(help="Only these tags, such as 7 or 0-3; all by default.")] = "",
    family: Annotated[str, typer.Option(help="Tag family.")] = "tag36h11",
    rate: Annotated[float, typer.Option(help="Most pictures kept each second.")] = 5.0,
    heartbeat: Annotated[
        float,
        typer.Option(metavar="SECONDS", help="Keep a picture this often though it shows no tag; 0 keeps none."),
    ] = 1.5,
    quality: Annotated[int, typer.Option(help="JPEG quality, 1 to 100.")] = 95,
    size: Annotated[str, typer.Option(metavar="WIDTHxHEIGHT", help="Asked of a USB camera, px.")] = "",
    decimate: Annotated[float, typer.Option(min=1.0, max=8.0, help="Shrink frames by this to look for tags.")] = 2.0,
    duration: Annotated[float | None, typer.Option(metavar="SECONDS", help="Stop after this long.")] = None,
    start: Annotated[
        str, typer.Option(metavar="UTC", help="When a video file began, such as 2026-05-22T14:03:00Z.")
    ] = "",
    port: Annotated[int, typer.Option(help="Of the preview page, on this computer only; 0 takes a free one.")] = 0,
) -> None:
    """Record the arrivals that a camera at a waypoint sees: pictures with a tag in view, named by their UTC time.

    In between, a picture every 1.5 s proves that the camera was on: a robot that never came is then told from a camera
    that was off.

    A source that is lost is opened again. Ctrl-C ends the recording; the same command goes on with it. The offset of
    this computer's clock is noted with each picture, where chrony or systemd tells it.

    Examples: `taskslam camera record 0 --out overhead/east --ids 7`,
    `taskslam camera record rtsp://10.0.0.5/stream --out overhead/west`
    """
    import re
    import signal
    import threading

    from taskslam.errors import DiskFullError, InputError
    from taskslam.realworld.cameras.live_page import Preview
    from taskslam.realworld.cameras.recording import RecordSettings
    from taskslam.realworld.cameras.recording import record as run
    from taskslam.realworld.cameras.video_source import VideoSource, file_start
    from taskslam.realworld.tags.tag_sheets import parse_ids

    settings = RecordSettings(
        family, tuple(parse_ids(ids)) if ids else None, rate, quality, decimate, duration, heartbeat or None
    )
    wanted = re.fullmatch(r"(\d{1,5})x(\d{1,5})", size)
    if size and wanted is None:
        raise InputError(f"--size {size}: expected WIDTHxHEIGHT, such as 1280x720")
    began = _utc_ns(start) if start else None
    video = VideoSource(source, (int(wanted[1]), int(wanted[2])) if wanted else None, began)
    if video.is_file and began is None:
        say(f"{source}: no --start given; the time of its last change less its length is taken", err=True)
        video.close()
        video = VideoSource(source, None, file_start(source))
    stop = threading.Event()
    with Preview(f"{video.shown_name} → {out}", port) as preview:
        say(f"preview: {preview.url}")
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: stop.set())
        summary = run(video, out, settings, stop, preview, lambda text: say(text, err=True))
    say(
        f"{out}: {summary.kept} pictures kept of {summary.frames} frames looked at, {summary.heartbeats} more without "
        f"a tag as a heartbeat, {summary.skipped} skipped, "
        f"source opened {summary.connections} times"
    )
    if summary.disk_full:
        raise DiskFullError(f"the recording has stopped with what it has: {summary.ended}")
    if not summary.connections and video.is_file:
        raise InputError(f"{source}: not a video that can be read")


def _utc_ns(text: str) -> int:
    from datetime import UTC, datetime

    from taskslam.errors import InputError

    try:
        moment = datetime.fromisoformat(text)
    except ValueError as error:
        raise InputError(f"--start {text}: expected a time such as 2026-05-22T14:03:00Z") from error
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return round(moment.timestamp() * 1e6) * 1000
