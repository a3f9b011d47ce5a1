"""What cameras saw, on a synthetic run with real JPEG pictures beside it."""

import base64
import io
import re

import numpy as np
import pytest
from PIL import Image

from taskslam.errors import RecordError
from taskslam.realworld.measured_file import FILE, FOLDER, ArrivalRow, MeasuredFile, dump_measured
from taskslam.report import write_report
from taskslam.report.page.photos import measured_view, overlay_figure
from taskslam.report.results import read_results


def picture(kind="JPEG", size=(64, 48)):
    buffer = io.BytesIO()
    Image.fromarray(np.random.default_rng(3).integers(0, 256, size, dtype=np.uint8)).save(buffer, kind)
    return buffer.getvalue()


def arrival(number=0, goal=0, verdict="measured", reason="", name="a.jpg", priming=False, sd=(0.003, 0.004, 0.01)):
    return ArrivalRow(
        round=number, goal=goal, priming=priming, station="tag", verdict=verdict, reason=reason, image="1.png",
        picture=name, frames=5, pose=(0.0, 0.0, 0.0), sd=sd, residual_px=None, margin_px=None, spread_m=None,
        other_heading=None,
    )  # fmt: skip


@pytest.fixture
def measured(make_run, tmp_path):
    """The first run of the folder as a measured one, with these arrivals and files beside it."""

    def make(arrivals, files=()):
        folder = make_run(source="measured", truth_frame="map") / FOLDER
        folder.mkdir()
        content = MeasuredFile(
            direction="outside-in", published=False, clock_offsets={}, planes=(), notes=(), arrivals=tuple(arrivals)
        )
        (folder / FILE).write_bytes(dump_measured(content))
        for name, data in dict(files).items():
            (folder / name).write_bytes(data)
        (run,) = read_results([tmp_path / "results"]).runs
        return run

    return make


def photos(run):
    return [photo for row in measured_view(run.record, run.metrics).rows for photo in row.photos]


def test_a_picture_is_kept_byte_for_byte_with_how_sure_it_is(measured):
    content = picture()
    (photo,) = photos(measured([arrival()], {"a.jpg": content}))
    kind, _, data = photo.source.partition(",")
    assert kind == "data:image/jpeg;base64"
    assert base64.b64decode(data) == content
    assert (photo.caption, photo.verdict, photo.note) == ("Round 1", "measured", "±5.0 mm, 5 images")


@pytest.mark.parametrize(
    "content",
    [b"", b"\xff\xd8", picture()[:-200], picture("PNG"), b"<svg onload='alert(1)'/>", picture(size=(1500, 1500))],
    ids=["empty", "only a beginning", "cut off", "PNG", "not a picture", "large"],
)
def test_what_is_no_small_whole_jpeg_is_left_out_and_said(measured, content):
    (photo,) = photos(measured([arrival()], {"a.jpg": content}))
    assert photo.source == ""
    assert photo.note == "±5.0 mm, 5 images; its picture is missing or damaged"


@pytest.mark.parametrize("name", ["gone.jpg", "../outside.jpg", "/outside.jpg", ".", "folder"])
def test_a_picture_that_is_gone_or_lies_elsewhere_is_left_out_and_said(measured, name):
    run = measured([arrival(name=name)])
    (run.record.directory / "outside.jpg").write_bytes(picture())
    (run.record.directory / FOLDER / "folder").mkdir()
    (photo,) = photos(run)
    assert photo.source == ""
    assert "missing or damaged" in photo.note


def test_an_arrival_that_nobody_saw_says_why_and_misses_no_picture(measured):
    (photo,) = photos(measured([arrival(verdict="not seen", reason="no tag in 5 images", name=None, sd=None)]))
    assert (photo.source, photo.verdict, photo.note) == ("", "not seen", "no tag in 5 images")


def test_priming_rounds_and_waypoints_without_a_camera_have_no_row(measured):
    run = measured([arrival(goal=1), arrival(goal=1, number=1), arrival(goal=2, priming=True)], {"a.jpg": picture()})
    rows = measured_view(run.record, run.metrics).rows
    assert [(row.goal, len(row.photos)) for row in rows] == [(1, 2)]


def test_all_arrivals_lie_over_one_another_inside_the_drawing(measured):
    waypoint = measured([]).metrics.waypoints[0]
    drawn = overlay_figure(waypoint, diameter=0.3)
    outlines = [float(x) for x in re.findall(r'<circle cx="([\d.]+)"', drawn)]
    assert len(outlines) == waypoint.visits == 3
    assert all(0 < x < 168 for x in outlines)
    assert "robots of 30 cm" in drawn


def test_a_run_that_was_simulated_has_no_photos(make_run, tmp_path):
    make_run()
    (run,) = read_results([tmp_path / "results"]).runs
    assert measured_view(run.record, run.metrics) is None


def test_a_damaged_list_is_an_error_and_the_page_names_it(measured, tmp_path):
    run = measured([arrival()])
    (run.record.directory / FOLDER / FILE).write_text('{"direction": "sideways"}')
    with pytest.raises(RecordError, match=r"arrivals\.json"):
        measured_view(run.record, run.metrics)
    page = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    assert "What the cameras saw" not in page
    assert FILE in page[page.index('id="left-out"') :]
