from __future__ import annotations

import csv
import json
import os
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import DiskFullError, InputError
from taskslam.realworld.cameras.frame_folder import FrameFolder
from taskslam.realworld.cameras.host_clock import ClockState
from taskslam.realworld.cameras.images import read_grey
from taskslam.realworld.cameras.live_page import Preview
from taskslam.realworld.cameras.recording import RecordSettings, record
from taskslam.realworld.cameras.video_source import VideoSource, file_start
from taskslam.realworld.looks import image_frames
from taskslam.realworld.tags.tag_family import code_cells

cv2 = pytest.importorskip("cv2")
pytest.importorskip("apriltag")
START = 1_716_393_934_250_000_000
CLOCK = ClockState(-0.02, "chrony")


def frame(tag: int | None) -> np.ndarray:
    image = np.full((180, 240, 3), 200, np.uint8)
    if tag is not None:
        image[50:130, 80:160] = np.kron(code_cells("tag36h11", tag), np.ones((10, 10)))[..., None] * 200 + 20
    return image


def video(path: Path, tags: list[int | None], rate: float = 10.0) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), rate, (240, 180))
    for tag in tags:
        writer.write(frame(tag))
    writer.release()
    return path


def table(folder: Path) -> list[dict[str, str]]:
    return list(csv.DictReader((folder / "frames.csv").read_text().splitlines()))


def test_frames_with_a_tag_are_kept_under_their_time(tmp_path: Path) -> None:
    file = video(tmp_path / "v.avi", [None, None, 7, 7, None, 3, 7])
    source = VideoSource(str(file), start=START)
    summary = record(source, tmp_path / "east", RecordSettings(ids=(7,), rate=1000, heartbeat=None), threading.Event())
    rows = table(tmp_path / "east")
    assert (summary.frames, summary.kept, summary.ended) == (7, 3, "the video has ended")
    assert [int(row["stamp_ns"]) for row in rows] == pytest.approx([START + k * 10**8 for k in (2, 3, 6)], abs=10**6)
    assert [row["ids"] for row in rows] == ["7"] * 3
    frames = image_frames(tmp_path / "east")
    assert [str(kept.stamp) for kept in frames] == [row["stamp_ns"] for row in rows]
    assert read_grey(frames[0].path).shape == (180, 240)


def test_a_frame_without_a_tag_is_kept_as_a_heartbeat(tmp_path: Path) -> None:
    """From the first frame on, every 0.4 s; not while pictures with a tag show that the camera is on."""
    file = video(tmp_path / "v.avi", [None] * 9 + [7] * 10 + [None] * 6)
    settings = RecordSettings(ids=(7,), rate=5.0, heartbeat=0.4)
    summary = record(VideoSource(str(file), start=START), tmp_path / "east", settings, threading.Event())
    kept = [(round((int(row["stamp_ns"]) - START) / 1e8), row["ids"]) for row in table(tmp_path / "east")]
    blank, seen = [at for at, ids in kept if not ids], [at for at, ids in kept if ids]
    assert blank == [0, 4, 8, 22]
    assert seen == [10, 12, 14, 16, 18]  # a fifth of a second after the last of any kind
    assert (summary.kept, summary.heartbeats) == (5, 4)


def test_a_pause_of_five_seconds_has_a_heartbeat_in_either_half() -> None:
    heartbeat = RecordSettings().heartbeat
    assert heartbeat is not None
    for phase in np.linspace(0, heartbeat, 50):
        beats = np.arange(phase, 5.0, heartbeat)
        assert len(beats) >= 3
        assert (beats < 2.5).any()
        assert (beats >= 2.5).any()


def test_the_rate_bounds_what_is_kept(tmp_path: Path) -> None:
    source = VideoSource(str(video(tmp_path / "v.avi", [7] * 20)), start=START)
    assert record(source, tmp_path / "east", RecordSettings(rate=2.0), threading.Event()).kept == 4


def test_a_recording_goes_on_in_its_folder_after_a_crash(tmp_path: Path) -> None:
    folder = FrameFolder(tmp_path / "east")
    folder.add(START, b"one", [7], CLOCK)
    with (tmp_path / "east" / "frames.csv").open("a") as file:
        file.write("17163939")  # the power went off
    again = FrameFolder(tmp_path / "east")
    assert again.kept_before == 1
    again.add(START, b"two", [7, 8], ClockState(None, "x,\ny"))
    rows = table(tmp_path / "east")
    assert [row["stamp_ns"] for row in rows] == [str(START), str(START + 1)]
    assert [row["clock_offset_s"] for row in rows] == ["-0.020000", ""]
    assert rows[1]["clock_told_by"] == "x; y"
    assert (tmp_path / "east" / rows[0]["picture"]).read_bytes() == b"one"


def test_another_programs_table_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "frames.csv").write_text("a,b\n")
    with pytest.raises(InputError, match="not the table of a recording"):
        FrameFolder(tmp_path)


def test_a_full_disk_ends_the_recording_with_what_it_has(tmp_path: Path) -> None:
    """A limit on file sizes stands in for the disk: the table is full after a few rows."""
    code = (
        "import resource, sys, threading\n"
        "from pathlib import Path\n"
        "from taskslam.realworld.cameras.recording import RecordSettings, record\n"
        "from taskslam.realworld.cameras.video_source import VideoSource\n"
        "import cv2\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (9000, 9000))\n"
        "source, settings = VideoSource(sys.argv[1], start=0), RecordSettings(rate=1000)\n"
        "s = record(source, Path(sys.argv[2]), settings, threading.Event())\n"
        "print(s.disk_full, s.kept, s.ended)"
    )
    file = video(tmp_path / "v.avi", [7, 7, 7])
    writer = cv2.VideoWriter(str(file), cv2.VideoWriter_fourcc(*"MJPG"), 10.0, (240, 180))
    for number in range(6):
        noise = np.random.default_rng(0).integers(0, 40, (180, 240, 3)) if number == 4 else 0
        writer.write((frame(7) + noise).astype(np.uint8))  # the fifth picture is too large
    writer.release()
    done = subprocess.run(
        [sys.executable, "-c", code, file, tmp_path / "east"], capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout.startswith("True 4 "), done
    assert "cannot be written: File too large" in done.stdout
    pictures = sorted((tmp_path / "east").glob("*.jpg"))
    assert [row["picture"] for row in table(tmp_path / "east")] == [picture.name for picture in pictures]
    assert all(read_grey(picture).shape == (180, 240) for picture in pictures)
    assert not list((tmp_path / "east").glob(".*"))


def test_a_table_without_space_for_a_row_stays_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = FrameFolder(tmp_path)
    folder.add(START, b"one", [7], CLOCK)
    before = (tmp_path / "frames.csv").read_bytes()
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 10, old[1]))
    try:
        with pytest.raises(DiskFullError):
            folder.add(START + 5, b"two", [7], CLOCK)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
    assert (tmp_path / "frames.csv").read_bytes() == before


class Stream:
    """A camera on the network: an MJPEG stream on the loopback address that can be unplugged."""

    def __init__(self, port: int = 0) -> None:
        stream, self.live = self, threading.Event()
        self.live.set()

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self.send_response(200)
                self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
                self.end_headers()
                data = cv2.imencode(".jpg", frame(7))[1].tobytes()
                head = b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(data)
                try:
                    while stream.live.is_set():
                        self.wfile.write(head + data + b"\r\n")
                        time.sleep(0.04)
                except OSError:
                    pass

            def log_message(self, *_: object) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
        self.server.daemon_threads = True
        threading.Thread(target=self.server.serve_forever, args=(0.05,), daemon=True).start()
        self.port = self.server.server_address[1]

    def unplug(self) -> None:
        self.live.clear()
        self.server.shutdown()
        self.server.server_close()


@pytest.fixture
def stream() -> Iterator[Stream]:
    made = Stream()
    yield made
    made.unplug()


def test_a_stream_that_is_unplugged_is_taken_up_again(tmp_path: Path, stream: Stream) -> None:
    stop, said = threading.Event(), []
    source = VideoSource(f"http://user:secret@127.0.0.1:{stream.port}/stream")
    assert "secret" not in source.shown_name
    before = time.time_ns()
    result: list[object] = []
    worker = threading.Thread(
        target=lambda: result.append(
            record(source, tmp_path / "east", RecordSettings(rate=1000), stop, say=said.append)
        )
    )
    worker.start()

    def kept() -> int:
        return len(list((tmp_path / "east").glob("*.jpg")))

    def wait_until(more: int) -> None:
        deadline = time.monotonic() + 90
        while kept() < more and time.monotonic() < deadline:
            time.sleep(0.1)
        assert kept() >= more

    wait_until(3)
    stream.unplug()
    deadline = time.monotonic() + 60
    while source.state == "live" and time.monotonic() < deadline:
        time.sleep(0.1)
    had = kept()
    replugged = Stream(stream.port)
    wait_until(had + 3)
    stop.set()
    worker.join(30)
    replugged.unplug()
    (summary,) = result
    assert summary.connections >= 2  # type: ignore[attr-defined]
    assert any("lost, connecting again" in sentence for sentence in said)
    stamps = [kept_frame.stamp for kept_frame in image_frames(tmp_path / "east")]
    set_meanwhile = 1_000_000_000  # ns by which the machine's clock may be set during the test
    assert before - set_meanwhile < stamps[0]
    assert stamps[-1] < time.time_ns() + set_meanwhile


def test_the_preview_shows_the_picture_to_this_computer_only() -> None:
    with Preview("east <camera>") as preview:
        preview.show(b"\xff\xd8jpeg", "live", "clock?")
        assert b"east &lt;camera&gt;" in urllib.request.urlopen(preview.url, timeout=10).read()
        assert urllib.request.urlopen(preview.url + "picture.jpg?1", timeout=10).read() == b"\xff\xd8jpeg"
        status = json.load(urllib.request.urlopen(preview.url + "status.json", timeout=10))
        assert status == {"text": "live", "warning": "clock?", "number": 1}
        for path, host in (("", "evil.example"), ("../etc/passwd", "127.0.0.1"), ("nothing", "127.0.0.1")):
            request = urllib.request.Request(preview.url + path, headers={"Host": host})
            with pytest.raises(urllib.error.HTTPError, match="404"):
                urllib.request.urlopen(request, timeout=10)
        port = int(preview.url.rsplit(":", 1)[1].strip("/"))
        with pytest.raises(InputError, match="name another"):
            Preview("second", port)
        with socket.socket() as other, pytest.raises(OSError, match="refused"):
            other.connect(("127.0.0.2", port))


def test_a_file_tells_when_it_began_by_its_last_change(tmp_path: Path) -> None:
    file = video(tmp_path / "v.avi", [None] * 20, rate=10.0)
    os.utime(file, ns=(START, START))
    assert file_start(str(file)) == pytest.approx(START - 2 * 10**9, abs=10**7)


def test_what_is_no_source_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        VideoSource(str(tmp_path / "none.avi"))
    (tmp_path / "text.avi").write_text("no video")
    source = VideoSource(str(tmp_path / "text.avi"))
    summary = record(source, tmp_path / "east", RecordSettings(), threading.Event())
    assert (summary.frames, summary.connections) == (0, 0)
    with pytest.raises(InputError, match="expected a rate"):
        RecordSettings(rate=0)
    with pytest.raises(InputError, match="heartbeat 0"):
        RecordSettings(heartbeat=0)


def test_an_interrupt_ends_a_recording_in_order(tmp_path: Path, stream: Stream) -> None:
    process = subprocess.Popen(
        [
            *(sys.executable, "-c", "from taskslam.cli.main import main; main()", "camera", "record"),
            *(f"http://127.0.0.1:{stream.port}/", "--out", str(tmp_path / "east")),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 90
    while not list(tmp_path.glob("east/*.jpg")) and time.monotonic() < deadline:
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    out, errors = process.communicate(timeout=60)
    assert process.returncode == 0, errors
    assert "pictures kept of" in out
    assert len(table(tmp_path / "east")) == len(list(tmp_path.glob("east/*.jpg"))) > 0
