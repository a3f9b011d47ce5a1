"""Finding AprilTags in grey images, in a child process: a crash of the C library costs one image, never the run."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from taskslam.errors import DetectorError, InputError
from taskslam.processes.messages import Arrays, Header, MessageReader, WireError, pack
from taskslam.realworld.extra import missing
from taskslam.realworld.tags.tag_family import DEFAULT_FAMILY, check_family

FloatArray = npt.NDArray[np.float64]

_PIPE_SIZE = 1 << 20
_START_TIMEOUT_S = 60.0
_SMALLEST_SIDE = 16  # px: no tag is found in less, and the library aborts on images of a few pixels


@dataclass(frozen=True, eq=False, slots=True)
class Tag:
    """A tag seen in an image.

    hamming: code bits that had to be corrected. margin: how far its cells are from grey, the library's decision margin.
    corners: (4, 2) px, top left, top right, bottom right, bottom left of the official artwork, wherever they lie in the
    image; (0, 0) is the centre of the first pixel (OpenCV's convention).
    """

    id: int
    family: str
    hamming: int
    margin: float
    corners: FloatArray


@dataclass(frozen=True, slots=True)
class DetectorSettings:
    """The C library's own settings.

    family: one of `tag_family.CELLS`. maxhamming: code bits corrected, 0 to 3 (the library's tables grow steeply).
    decimate: by what the image is shrunk to look for squares. blur: sigma, px, of a Gaussian before that. refine_edges:
    fit the edges again at full resolution. threads: of the library.
    """

    family: str = DEFAULT_FAMILY
    maxhamming: int = 1
    decimate: float = 1.0
    blur: float = 0.0
    refine_edges: bool = True
    threads: int = 1

    def __post_init__(self) -> None:
        check_family(self.family)
        if not 0 <= self.maxhamming <= 3:
            raise InputError(f"maxhamming {self.maxhamming}: expected 0 to 3")
        if not 1.0 <= self.decimate <= 8.0 or not 0.0 <= self.blur <= 10.0 or not 1 <= self.threads <= 64:
            raise InputError(
                f"decimate {self.decimate}, blur {self.blur}, threads {self.threads}: "
                "expected 1 to 8, 0 to 10 px and 1 to 64"
            )


class Detector:
    """Looks for tags in a child process; a context manager.

    ids: only these are reported; None for all. timeout_s: after this long without an answer an image is given up.

    Raises:
        InputError: settings out of range, or the package is not installed (when the first image is looked at).
    """

    def __init__(
        self,
        family: str = DEFAULT_FAMILY,
        ids: Iterable[int] | None = None,
        maxhamming: int = 1,
        decimate: float = 1.0,
        blur: float = 0.0,
        refine_edges: bool = True,
        threads: int = 1,
        timeout_s: float = 60.0,
    ) -> None:
        self.settings = DetectorSettings(family, maxhamming, decimate, blur, refine_edges, threads)
        self._ids = None if ids is None else frozenset(ids)
        self._timeout_s = timeout_s
        self._child: subprocess.Popen[bytes] | None = None
        self._reader = MessageReader()

    def __enter__(self) -> Detector:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def detect(self, image: npt.NDArray[np.uint8], name: str = "image") -> list[Tag]:
        """Tags in a grey image (H, W), by id, then from left to right. name: what an error calls the image.

        A child that dies over an image is started again and given it once more.

        Raises:
            DetectorError: the detector died twice, or gave no answer in time; the next image starts afresh.
            InputError: not a grey image, or the package is not installed.
        """
        if image.ndim != 2 or image.dtype != np.uint8:
            raise InputError(f"{name}: shape {image.shape} {image.dtype}; expected a grey image (H, W) of uint8")
        if min(image.shape) < _SMALLEST_SIDE:
            return []
        try:
            message = pack({}, {"image": np.ascontiguousarray(image)})
        except WireError as error:
            raise InputError(f"{name}: {image.shape[1]} x {image.shape[0]} pixels are too many: {error}") from error
        try:
            header, arrays = self._ask(message, name)
        except _DiedError:
            try:
                header, arrays = self._ask(message, name)
            except _DiedError as error:
                raise DetectorError(f"{name}: the tag detector died twice over this image ({error})") from error
        family = self.settings.family
        tags = [
            Tag(tag_id, family, hamming, margin, corners)
            for tag_id, hamming, margin, corners in zip(
                header["ids"], header["hamming"], header["margin"], arrays["corners"], strict=True
            )
            if (self._ids is None or tag_id in self._ids) and np.isfinite(corners).all()
        ]
        return sorted(tags, key=lambda tag: (tag.id, *tag.corners.mean(0)))

    def close(self) -> None:
        """End the child. The detector may be used again: it then starts another."""
        child, self._child = self._child, None
        if child is None:
            return
        for stream in (child.stdin, child.stdout):
            assert stream is not None
            with contextlib.suppress(OSError):
                stream.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.wait(0.5)
        child.kill()
        child.wait()

    @property
    def pid(self) -> int | None:
        """Process id of the child, None before the first image."""
        return None if self._child is None else self._child.pid

    def _start(self) -> None:
        search = os.pathsep.join(str(Path(entry).resolve()) for entry in sys.path if entry)
        self._child = subprocess.Popen(  # noqa: S603
            [sys.executable, "-P", "-m", "taskslam.realworld.tags.detector_child", json.dumps(asdict(self.settings))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": search},
            bufsize=0,
            start_new_session=True,  # Ctrl-C is for the parent to deal with
        )
        self._reader = MessageReader()
        assert self._child.stdin is not None
        for stream in (self._child.stdin, self._child.stdout):
            assert stream is not None
            with contextlib.suppress(OSError):
                fcntl.fcntl(stream, fcntl.F_SETPIPE_SZ, _PIPE_SIZE)
        os.set_blocking(self._child.stdin.fileno(), False)
        ready, _ = self._exchange(memoryview(b""), "starting", max(self._timeout_s, _START_TIMEOUT_S))
        if "ready" not in ready:
            self.close()
            if "refused" in ready:
                raise InputError(f"the AprilTag library refuses {asdict(self.settings)}: {ready['refused']}")
            raise missing("The AprilTag library")

    def _ask(self, message: bytes, name: str) -> tuple[Header, Arrays]:
        if self._child is None:
            self._start()
        return self._exchange(memoryview(message), name, self._timeout_s)

    def _exchange(self, rest: memoryview, name: str, timeout_s: float) -> tuple[Header, Arrays]:
        """Write `rest` and wait for one message."""
        child = self._child
        assert child is not None
        assert child.stdin is not None
        assert child.stdout is not None
        request, reply = child.stdin.fileno(), child.stdout.fileno()
        deadline = time.monotonic() + timeout_s
        poller = select.poll()
        poller.register(reply, select.POLLIN)
        poller.register(request, select.POLLOUT)
        while (remaining := deadline - time.monotonic()) > 0:
            if not rest:
                poller.modify(request, 0)
            ready = dict(poller.poll(remaining * 1000))
            if ready.get(reply, 0):
                chunk = os.read(reply, _PIPE_SIZE)
                if not chunk:
                    raise self._died()
                for message in self._reader.messages(chunk):
                    return message
            elif rest and ready.get(request, 0):
                with contextlib.suppress(BlockingIOError, BrokenPipeError):  # a dead child's reply pipe ends, too
                    rest = rest[os.write(request, rest) :]
        child.kill()
        self.close()
        raise DetectorError(f"{name}: no answer from the tag detector in {timeout_s:g} s")

    def _died(self) -> _DiedError:
        child = self._child
        assert child is not None
        self.close()
        code = child.returncode
        return _DiedError(f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit code {code}")


class _DiedError(Exception):
    """The child is gone."""
