"""Frames from a camera, a stream or a file, each with the time at which it came; a lost source is opened again."""

from __future__ import annotations

import re
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.errors import InputError
from taskslam.measurements import NANOSECONDS
from taskslam.reading import is_file
from taskslam.realworld.extra import load_opencv

_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.5, 15.0
_NETWORK_TIMEOUT_MS = 5000

Picture = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False, slots=True)
class StampedPicture:
    """A frame as it came, (H, W, 3) BGR or (H, W), and its UTC stamp, ns since 1970."""

    stamp: int
    image: Picture


class VideoSource:
    """Reads a source in a thread of its own, so that a frame is stamped when it comes, not when there is time for it.

    name: an index (USB camera), a URL (RTSP, HTTP) or a file. Of a live source only the newest frame is kept for
    `next`; a file waits, and its frames are stamped `start` (ns) plus their time in the file. size: asked of a USB
    camera.

    Raises:
        InputError: a file that is not there.
    """

    def __init__(self, name: str, size: tuple[int, int] | None = None, start: int | None = None) -> None:
        self._cv2 = load_opencv()
        self._name, self._size = name, size
        self.shown_name = re.sub(r"//[^/@]*@", "//", name)  # without a password
        self.is_file = not name.isdecimal() and "://" not in name
        if self.is_file and not is_file(Path(name)):
            raise InputError(f"{name}: no such file; expected an index such as 0, a URL or a video file")
        self._start = start
        self._changed = threading.Condition()
        self._waiting: StampedPicture | None = None
        self._stop = self.ended = False
        self.state = "connecting"
        self.connections = 0
        self.skipped = 0
        self._thread = threading.Thread(target=self._run, name="video-source", daemon=True)
        self._thread.start()

    def next(self, timeout_s: float) -> StampedPicture | None:
        """The newest frame not yet given, or None after `timeout_s`, or at once when a file has ended."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting is not None or self.ended, timeout_s)
            frame, self._waiting = self._waiting, None
            self._changed.notify_all()
            return frame

    @property
    def finished(self) -> bool:
        """Whether no frame will come any more."""
        with self._changed:
            return self.ended and self._waiting is None

    def close(self) -> None:
        """Stop reading; does not wait for a source that hangs."""
        with self._changed:
            self._stop = True
            self._changed.notify_all()
        self._thread.join(1.0)

    def _run(self) -> None:
        pause = _FIRST_PAUSE_S
        while not self._stop:
            video = self._open()
            if video is not None:
                self.connections += 1
                if self._read(video):
                    pause = _FIRST_PAUSE_S
                video.release()
            if self.is_file:
                break
            self.state = "lost, connecting again"
            with self._changed:
                self._changed.wait_for(lambda: self._stop, pause)
            pause = min(2 * pause, _LONGEST_PAUSE_S)
        with self._changed:
            self.ended, self.state = True, "ended"
            self._changed.notify_all()

    def _open(self) -> Any:
        cv2 = self._cv2
        try:
            if self._name.isdecimal():
                video = cv2.VideoCapture(int(self._name))
                if self._size is not None:
                    video.set(cv2.CAP_PROP_FRAME_WIDTH, self._size[0])
                    video.set(cv2.CAP_PROP_FRAME_HEIGHT, self._size[1])
            elif self.is_file:
                video = cv2.VideoCapture(self._name)
            else:
                limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, _NETWORK_TIMEOUT_MS]
                limits += [cv2.CAP_PROP_READ_TIMEOUT_MSEC, _NETWORK_TIMEOUT_MS]
                video = cv2.VideoCapture(self._name, cv2.CAP_FFMPEG, limits)
        except cv2.error:
            return None
        if video.isOpened():
            return video
        video.release()
        return None

    def _read(self, video: Any) -> bool:
        """Read until the source is lost or ended; whether any frame came."""
        cv2, any_came = self._cv2, False
        while not self._stop:
            try:
                if not video.grab():
                    return any_came
                stamp = time.time_ns()
                if self.is_file and self._start is not None:
                    stamp = self._start + round(video.get(cv2.CAP_PROP_POS_MSEC) * (NANOSECONDS // 1000))
                good, image = video.retrieve()
            except cv2.error:
                return any_came
            if not good or image is None or image.dtype != np.uint8:
                continue
            any_came = True
            self.state = "live"
            with self._changed:
                if self.is_file:
                    self._changed.wait_for(lambda: self._waiting is None or self._stop)
                elif self._waiting is not None:
                    self.skipped += 1
                self._waiting = StampedPicture(stamp, image)
                self._changed.notify_all()
        return any_came


def file_start(name: str) -> int:
    """When a video file's first frame was taken, as far as the file tells: its last change less its length, UTC ns."""
    cv2 = load_opencv()
    video = cv2.VideoCapture(name)
    rate, frames = video.get(cv2.CAP_PROP_FPS), video.get(cv2.CAP_PROP_FRAME_COUNT)
    video.release()
    length = frames / rate if 0 < rate < 1000 and 0 < frames < 1e9 else 0.0
    return Path(name).stat().st_mtime_ns - round(length * NANOSECONDS)
