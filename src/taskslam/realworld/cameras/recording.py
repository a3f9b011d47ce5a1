"""Recording at a waypoint: frames in which a tag is seen are kept, each with its UTC time, until told to stop.

Every so often a frame is kept though it shows no tag. Without it, a robot that is elsewhere and a camera that is off
would leave the same behind, which is nothing.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taskslam.errors import DetectorError, DiskFullError, InputError
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.realworld.cameras.frame_folder import FrameFolder
from taskslam.realworld.cameras.host_clock import ClockState, clock_state
from taskslam.realworld.cameras.live_page import Preview
from taskslam.realworld.cameras.video_source import Picture, VideoSource
from taskslam.realworld.extra import load_opencv
from taskslam.realworld.tags.detector import Detector, Tag
from taskslam.realworld.tags.tag_family import DEFAULT_FAMILY

_CLOCK_EVERY_S = 60.0
_SHOW_EVERY_S = 0.4
_WAIT_S = 0.5
_PREVIEW_WIDTH = 960

HEARTBEAT = 1.5
"""s. Three frames in a pause of 5 s: some in either half of it, which proves a robot absent, and as many, no more than
2 s apart, as measure one that this quick look at shrunken frames did not find."""


@dataclass(frozen=True, slots=True)
class RecordSettings:
    """What to keep. ids: tags to look for, None for all. rate: most frames kept each second. quality: of the JPEG.

    decimate: by what frames are shrunk to look for tags; evaluation looks again at full size. duration: s, or None.
    heartbeat: s after which a frame is kept though it shows no tag; None keeps none.
    """

    family: str = DEFAULT_FAMILY
    ids: tuple[int, ...] | None = None
    rate: float = 5.0
    quality: int = 95
    decimate: float = 2.0
    duration: float | None = None
    heartbeat: float | None = HEARTBEAT

    def __post_init__(self) -> None:
        if not 0 < self.rate <= 1000 or not 1 <= self.quality <= 100 or (self.duration or 1) <= 0:
            raise InputError(
                f"rate {self.rate}, quality {self.quality}, duration {self.duration}: expected a rate up to 1000 a "
                "second, a quality of 1 to 100 and a positive duration"
            )
        if self.heartbeat is not None and not self.heartbeat > 0:
            raise InputError(f"heartbeat {self.heartbeat}: expected seconds, more than 0, or none at all")


@dataclass(slots=True)
class RecordSummary:
    """How a recording went. frames: looked at; kept: with a tag; heartbeats: kept without one.

    skipped: frames not looked at for want of time; connections: how often the source was opened; crashes: frames over
    which the detector died; ended: why it ended.
    """

    frames: int = 0
    kept: int = 0
    heartbeats: int = 0
    skipped: int = 0
    connections: int = 0
    crashes: int = 0
    ended: str = ""
    disk_full: bool = False


def record(
    source: VideoSource,
    folder: Path,
    settings: RecordSettings,
    stop: threading.Event,
    preview: Preview | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> RecordSummary:
    """Record until the source's file ends, `stop` is set, the time is over or the disk is full.

    say: gets a sentence when something changes: the source is lost or back, the clock is off.

    Raises:
        DiskFullError: the folder cannot be made; a disk that fills up later only ends the recording.
        InputError: a folder with another program's table, or the detector is not installed.
    """
    summary = RecordSummary()
    kept = FrameFolder(folder)
    try:
        with Detector(settings.family, settings.ids, decimate=settings.decimate) as detector:
            _Recorder(source, kept, detector, settings, summary, preview, say).run(stop)
    finally:
        source.close()
    summary.skipped, summary.connections = source.skipped, source.connections
    return summary


class _Recorder:
    def __init__(
        self,
        source: VideoSource,
        folder: FrameFolder,
        detector: Detector,
        settings: RecordSettings,
        summary: RecordSummary,
        preview: Preview | None,
        say: Callable[[str], None],
    ) -> None:
        self._source, self._folder, self._detector = source, folder, detector
        self._settings, self._summary, self._preview, self._say = settings, summary, preview, say
        self._clock = ClockState(None, "not asked yet")
        self._told: dict[str, str] = {}
        self._clock_asked = self._shown = -np.inf
        self._last_kept: int | None = None

    def run(self, stop: threading.Event) -> None:
        """Work through frames until something ends it."""
        summary = self._summary
        began = time.monotonic()
        while not stop.is_set():
            now = time.monotonic()
            if self._settings.duration is not None and now - began > self._settings.duration:
                summary.ended = "the time is over"
                return
            if now - self._clock_asked > _CLOCK_EVERY_S:
                self._clock, self._clock_asked = clock_state(), now
                self._tell("clock", self._clock.warning or "The clock is right.", quiet=self._clock.warning is None)
            frame = self._source.next(_WAIT_S)
            state = self._source.state
            self._tell("source", f"{self._source.shown_name}: {state}", quiet=state == "connecting")
            if frame is None:
                if self._source.finished:
                    summary.ended = "the video has ended"
                    return
                self._show(None, [])
                continue
            summary.frames += 1
            tags = self._look(frame.image)
            self._show(frame.image, tags)
            if not self._is_due(frame.stamp, bool(tags)):
                continue
            try:
                self._folder.add(frame.stamp, self._jpeg(frame.image), [tag.id for tag in tags], self._clock)
            except DiskFullError as error:
                summary.ended, summary.disk_full = str(error), True
                return
            if tags:
                summary.kept += 1
            else:
                summary.heartbeats += 1
            self._last_kept = frame.stamp
        summary.ended = "told to stop"

    def _look(self, image: Picture) -> list[Tag]:
        grey = image if image.ndim == 2 else load_opencv().cvtColor(image, load_opencv().COLOR_BGR2GRAY)
        try:
            return self._detector.detect(grey, f"frame {self._summary.frames}")
        except DetectorError as error:
            self._summary.crashes += 1
            self._say(str(error))
            return []

    def _is_due(self, stamp: int, tagged: bool) -> bool:
        """Whether the rate, or without a tag the heartbeat, asks for another; a clock set back does not hold it up."""
        every = 1 / self._settings.rate if tagged else self._settings.heartbeat
        if every is None:
            return False
        return self._last_kept is None or not 0 <= stamp - self._last_kept < 0.98 * NANOSECONDS * every

    def _jpeg(self, image: Picture) -> bytes:
        cv2 = load_opencv()
        _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, self._settings.quality])
        return bytes(data)

    def _tell(self, about: str, sentence: str, quiet: bool = False) -> None:
        """Say what is new about something, once; quiet: only where something else was said of it before."""
        if self._told.get(about) != sentence:
            if about in self._told or not quiet:
                self._say(sentence)
            self._told[about] = sentence

    def _show(self, image: Picture | None, tags: Iterable[Tag]) -> None:
        now = time.monotonic()
        if self._preview is None or now - self._shown < _SHOW_EVERY_S:
            return
        self._shown = now
        names = ", ".join(str(tag.id) for tag in tags) or "none"
        text = f"{self._source.state}; {self._summary.kept} frames kept; tags in view: {names}"
        picture = None if image is None else _small(image, [tag.corners for tag in tags])
        self._preview.show(picture, text, self._clock.warning or "")


def _small(image: Picture, squares: list[FloatArray]) -> bytes:
    """A JPEG for the preview, tags outlined."""
    cv2 = load_opencv()
    drawn = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image.copy()
    for corners in squares:
        cv2.polylines(drawn, [np.rint(corners).astype(np.int32)], True, (0, 94, 213), 2 + image.shape[1] // 600)
    scale = min(1.0, _PREVIEW_WIDTH / drawn.shape[1])
    drawn = cv2.resize(drawn, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return bytes(cv2.imencode(".jpg", drawn, [cv2.IMWRITE_JPEG_QUALITY, 80])[1])
