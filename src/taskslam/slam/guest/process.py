"""A guest process: started apart from everything, heard through pipes, watched, and ended for certain.

`GuestProcess` knows processes, bytes and limits; what the bytes mean is `host.py`'s business.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from taskslam.errors import DiskFullError, HostFailedError
from taskslam.processes.confine import hide_this_process
from taskslam.processes.memory import kilobytes
from taskslam.slam.guest.shared_images import ImageSlots

_PIPE_SIZE = 1 << 20
_WATCH_PERIOD_S = 0.02
_AFTER_CAP_PAUSE_S = 0.02
_ANSWER_PERIOD_S = 0.1
_THAW_PERIOD_S = 0.005
_LAST_OUTPUT = 4096  # bytes kept to quote from
_LONGEST_WORDS = 160
_PYTHON_TELLS = "Fatal Python error"  # how its fault handler begins

# Only these variables reach a method: where programs, packages, caches and locales are.
_ENVIRONMENT = ("PATH", "HOME", "LANG", "LANGUAGE", "TZ", "LD_LIBRARY_PATH", "VIRTUAL_ENV", "PYTHONHASHSEED")
_ENVIRONMENT_PREFIXES = ("LC_", "NUMBA_", "XDG_CACHE", "TASKSLAM_METHOD_", "PYORBSLAM3_")
# One thread for numeric libraries, so that sums repeat; a method that declares threads of its own gets them back.
SINGLE_THREADED = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True, slots=True)
class Limits:
    """What a method may use. The times are wall time and only tell a hang from work; no result depends on them.

    frame_timeout_s: without any reply to what it was given; start_timeout_s: to import, construct and start (first
    compilation of numba included); stop_timeout_s: to end when asked; memory_bytes: resident memory of its process;
    log_bytes: kept of what it prints.
    """

    frame_timeout_s: float = 60.0
    start_timeout_s: float = 600.0
    stop_timeout_s: float = 3.0
    memory_bytes: int = 8 << 30
    log_bytes: int = 1 << 20


class GuestProcess:
    """A child running `taskslam.slam.guest.child` in a session and scratch folder of its own.

    local: the method lies in the user's working folder, which is then on the child's import path. images: the memory
    through which images travel; closed with the guest. freezes_itself: the child stops itself between frames
    (`pacing.py`) and must be woken when there is something to read.

    Raises:
        HostFailedError: the process cannot be started.
        DiskFullError: its log cannot be written.
    """

    def __init__(self, log: Path, limits: Limits, local: bool, images: ImageSlots | None = None) -> None:
        self._limits = limits
        self._images = images
        self.freezes_itself = False
        self.peak_memory = 0
        self.over_memory = False
        self.log_error: OSError | None = None
        self._last_output = b""
        try:
            self._log = log.open("ab")
        except OSError as error:
            self._close_images()
            raise DiskFullError(f"{log}: cannot write the method's log: {error.strerror}") from error
        try:
            self._folder = tempfile.TemporaryDirectory(prefix="taskslam-method-", ignore_cleanup_errors=True)
        except OSError as error:
            self._close_images()
            raise HostFailedError(f"cannot make a scratch folder for the method: {error}") from error
        self.scratch = Path(self._folder.name)
        self._request, self._reply, self._output = -1, -1, -1
        try:
            hide_this_process()
            self._start(_environment(local))
        except OSError as error:
            self._close()
            raise HostFailedError(f"cannot start a process for the method: {error}") from error
        self._watcher = threading.Thread(target=self._watch, name="method-watcher", daemon=True)
        self._watcher.start()

    def _start(self, environment: dict[str, str]) -> None:
        child_request, self._request = os.pipe()
        self._reply, child_reply = os.pipe()
        self._output, child_output = os.pipe()
        for descriptor in (self._request, self._reply):
            os.set_blocking(descriptor, False)
            with contextlib.suppress(OSError):  # a user's pipe budget may be used up: smaller pipes work too
                fcntl.fcntl(descriptor, fcntl.F_SETPIPE_SZ, _PIPE_SIZE)
        inherited = [child_request, child_reply]
        shared = []
        if self._images is not None:
            inherited.append(self._images.fileno)
            shared = [str(self._images.fileno), str(self._images.slot_size)]
        try:
            self._process = subprocess.Popen(  # noqa: S603
                [
                    sys.executable,
                    "-P",
                    "-m",
                    "taskslam.slam.guest.child",
                    str(child_request),
                    str(child_reply),
                    str(os.getpid()),
                    *shared,
                ],
                stdin=subprocess.DEVNULL,
                stdout=child_output,
                stderr=subprocess.STDOUT,
                cwd=self.scratch,
                env={**environment, "TMPDIR": str(self.scratch)},
                pass_fds=inherited,
                start_new_session=True,
            )
        finally:
            for descriptor in (child_request, child_reply, child_output):
                os.close(descriptor)
        self._status = f"/proc/{self._process.pid}/status"

    @property
    def ended(self) -> bool:
        """Whether `end` was called."""
        return self._request < 0

    def write(self, data: bytearray) -> None:
        """Write what the pipe takes and remove it from `data`. A dead child is not an error here but in `exchange`."""
        if not data:
            return
        try:
            while data:
                del data[: os.write(self._request, data)]
        except BlockingIOError:
            pass
        except BrokenPipeError:
            data.clear()
        self._thaw()

    def exchange(self, data: bytearray, timeout_s: float) -> bytes | None:
        """Write `data` and wait for a reply: its bytes, empty once the child is dead, None after `timeout_s`."""
        deadline = time.monotonic() + timeout_s
        while True:
            self.write(data)
            with contextlib.suppress(BlockingIOError):
                return os.read(self._reply, _PIPE_SIZE)
            if self._process.poll() is not None:  # dead, though a process that it left behind keeps the pipe open
                return b""
            remaining = deadline - time.monotonic()
            if remaining <= 0:
                return None
            poller = select.poll()
            poller.register(self._reply, select.POLLIN)
            if data:
                poller.register(self._request, select.POLLOUT)
            # It may have frozen just after the data came: what is waited for must not sleep.
            self._thaw()
            poller.poll(min(remaining, _THAW_PERIOD_S if self.freezes_itself else _ANSWER_PERIOD_S) * 1000)

    def _thaw(self) -> None:
        if self.freezes_itself:
            self._process.send_signal(signal.SIGCONT)

    def ending(self) -> str:
        """How the child ended, in words: killed by which signal, or exited with which code. Ends it if needed."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=1.0)
        if self.over_memory:
            return f"used more than {self._limits.memory_bytes / 1e6:.0f} MB of memory and was killed"
        code = self._process.poll()
        if code is None:
            return "closed its pipe without ending"
        if code < 0:
            return f"killed by {signal.Signals(-code).name}{self._last_words()}"
        return f"exited with code {code}"

    def _last_words(self) -> str:
        """What the child printed last before Python told where it was, quoted: a library's own reason to abort."""
        self._watcher.join(timeout=1.0)  # it ends with the child, once all output is read
        said = self._last_output.decode(errors="replace").partition(_PYTHON_TELLS)[0].split("\n")
        line = next((line.strip() for line in reversed(said) if line.strip()), "")
        printable = "".join(c for c in line if c.isprintable())
        return f' after printing "{printable[:_LONGEST_WORDS]}"' if printable else ""

    def end(self, grace_s: float) -> None:
        """Wait `grace_s` for the child to end by itself, then kill it and all that it started. Idempotent."""
        if self.ended:
            return
        deadline = time.monotonic() + grace_s
        while self._process.poll() is None and (remaining := deadline - time.monotonic()) > 0:
            self._thaw()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(min(remaining, _ANSWER_PERIOD_S))
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._watcher.join()
        self._close()

    def _close(self) -> None:
        for name in ("_request", "_reply", "_output"):
            if getattr(self, name) >= 0:
                os.close(getattr(self, name))
                setattr(self, name, -1)
        self._close_images()
        with contextlib.suppress(OSError):
            self._log.close()
        self._folder.cleanup()

    def _close_images(self) -> None:
        if self._images is not None:
            self._images.close()
            self._images = None

    def _watch(self) -> None:
        """Thread: keep the log up to its bound, throttle what exceeds it, watch the memory."""
        poller = select.poll()
        poller.register(self._output, select.POLLIN)
        kept = cut = 0
        alive = listening = True
        while alive or (listening and not cut):
            alive = self._process.poll() is None
            if alive:
                self._check_memory()
            if not listening:
                time.sleep(_WATCH_PERIOD_S)
                continue
            if not poller.poll(_WATCH_PERIOD_S * 1000):
                listening = alive
                continue
            text = os.read(self._output, 1 << 16)
            listening = bool(text)
            self._last_output = (self._last_output + text)[-_LAST_OUTPUT:]
            self._write_log(text[: self._limits.log_bytes - kept])
            cut += max(0, len(text) - (self._limits.log_bytes - kept))
            kept = min(self._limits.log_bytes, kept + len(text))
            if cut:
                time.sleep(_AFTER_CAP_PAUSE_S)  # the full pipe then slows the method's printing down
        if cut:
            self._write_log(f"\n[taskslam] at least {cut} more bytes were printed and not kept\n".encode())

    def _write_log(self, text: bytes) -> None:
        if self.log_error is None:
            try:
                self._log.write(text)
                self._log.flush()
            except OSError as error:
                self.log_error = error

    def _check_memory(self) -> None:
        try:
            with open(self._status, "rb") as file:  # noqa: PTH123
                status = file.read()
            resident = kilobytes(status, b"VmRSS:")
        except (OSError, ValueError):  # it ended just now
            return
        self.peak_memory = max(self.peak_memory, kilobytes(status, b"VmHWM:"))
        if resident > self._limits.memory_bytes and not self.over_memory:
            self.over_memory = True
            os.killpg(self._process.pid, signal.SIGKILL)


def _environment(local: bool) -> dict[str, str]:
    environment = {
        key: value for key, value in os.environ.items() if key in _ENVIRONMENT or key.startswith(_ENVIRONMENT_PREFIXES)
    }
    # What the benchmark can import, the child can; the folder in which the user works only if the method lies there.
    here = str(Path.cwd())
    search = [str(Path(entry).resolve()) for entry in sys.path if entry not in ("", here)]
    environment["PYTHONPATH"] = os.pathsep.join([*search, here] if local else search)
    environment.update(dict.fromkeys(SINGLE_THREADED, "1"))
    return environment
