"""A guest process: started apart from everything, heard through pipes, watched, and ended for certain.

`GuestProcess` knows processes, bytes and limits; what the bytes mean is its caller's business. Between it and the guest
stands a supervisor (`supervisor.py`), so that nothing that the guest starts outlives it.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import BinaryIO

from taskslam.errors import DiskFullError, HostFailedError
from taskslam.printable import one_line
from taskslam.processes import compiled_cache
from taskslam.processes.confine import hide_this_process
from taskslam.processes.patience import Patience
from taskslam.processes.scratch import Scratch
from taskslam.processes.supervisor import REPORT
from taskslam.processes.tree import Tree
from taskslam.processes.wall import Wall, working_folder
from taskslam.stopping import undisturbed

_PIPE_SIZE = 1 << 20
_WATCH_PERIOD_S = 0.02
_AFTER_CAP_PAUSE_S = 0.02
_LOOKING_SHARE = 10  # at most one part in so many of the time goes into looking at a method's memory
_ANSWER_PERIOD_S = 0.1
_THAW_PERIOD_S = 0.005
_LAST_RESORT_S = 10.0  # so long the supervisor has to kill what is left
_LAST_OUTPUT = 4096  # bytes kept to quote from
_LONGEST_WORDS = 160
_PYTHON_TELLS = "Fatal Python error"  # how its fault handler begins

# Only these variables reach a guest: where programs and packages are, and locales. Homes and caches are in its scratch.
# (With ROS 2's wheels every Python starts itself again so as to find their libraries, unless it is told that it has.)
STARTED_AGAIN = "_ROS_WHEELS_BOOTSTRAP_COMPLETE"
_ENVIRONMENT = ("PATH", "LANG", "LANGUAGE", "TZ", "LD_LIBRARY_PATH", STARTED_AGAIN, "VIRTUAL_ENV", "PYTHONHASHSEED")
METHOD_VARIABLES = ("TASKSLAM_METHOD_", "PYORBSLAM3_")
_ENVIRONMENT_PREFIXES = ("LC_", "NUMBA_", *METHOD_VARIABLES)
_COMPILED = "compiled"
# One thread for numeric libraries, so that sums repeat; a method that declares threads of its own gets them back.
SINGLE_THREADED = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True, slots=True)
class Limits:
    """What a method may use. The times are wall time and only tell a hang from work; no result depends on them.

    frame_timeout_s: without any reply to what it was given; start_timeout_s: to import, construct and start (first
    compilation of numba included); stop_timeout_s: to end when asked; memory_bytes: resident memory of all its
    processes; log_bytes: kept of what it prints.
    """

    frame_timeout_s: float = 60.0
    start_timeout_s: float = 600.0
    stop_timeout_s: float = 30.0
    memory_bytes: int = 8 << 30
    log_bytes: int = 1 << 20


@dataclass(frozen=True, slots=True)
class Program:
    """What a guest process runs.

    module: one of ours, run as `python -m` with `arguments` after the descriptors of its request and reply pipes.
    inherit: further descriptors that it gets. local: a folder on its import path beyond those of this process.
    compiled: where what numba compiles for it is kept, or None (`compiled_cache.py`).
    """

    module: str
    arguments: tuple[str, ...] = ()
    inherit: tuple[int, ...] = ()
    local: Path | None = None
    compiled: Path | None = None


@dataclass(slots=True)
class _Ends:
    """Our ends of the pipes: requests, replies, what is printed, and what the supervisor tells."""

    request: int = -1
    reply: int = -1
    output: int = -1
    report: int = -1
    theirs: list[int] = field(default_factory=list)

    @classmethod
    def made(cls) -> _Ends:
        child_request, request = os.pipe()
        reply, child_reply = os.pipe()
        output, child_output = os.pipe()
        report, child_report = os.pipe()
        for descriptor in (request, reply):
            os.set_blocking(descriptor, False)
            with contextlib.suppress(OSError):  # a user's pipe budget may be used up: smaller pipes work too
                fcntl.fcntl(descriptor, fcntl.F_SETPIPE_SZ, _PIPE_SIZE)
        return cls(request, reply, output, report, [child_request, child_reply, child_output, child_report])

    def close_theirs(self) -> None:
        while self.theirs:
            os.close(self.theirs.pop())

    def close(self) -> None:
        self.close_theirs()
        for name in ("request", "reply", "output", "report"):
            if getattr(self, name) >= 0:
                os.close(getattr(self, name))
                setattr(self, name, -1)


class GuestProcess:
    """A child running a program in a session and scratch folder of its own, behind a wall. Made `undisturbed`.

    freezes_itself: the child stops itself between frames (`pacing.py`) and must be woken when there is something to
    read. peak_memory: bytes resident at most in all its processes; cpu_s: their processor time, known at the end.

    Raises:
        HostFailedError: the process cannot be started.
        DiskFullError: its log cannot be written.
    """

    def __init__(self, program: Program, wall: Wall, log: Path, limits: Limits) -> None:
        self._program, self._limits = program, limits
        self.freezes_itself = False
        self.peak_memory = 0
        self.cpu_s = 0.0
        self.over_memory = False
        self.log_error: OSError | None = None
        self._last_output = b""
        self._guest = self._handle = -1
        self._ends = _Ends()
        self._log = _opened(log)
        try:
            self._scratch = Scratch("method")
        except OSError as error:
            self._log.close()
            raise HostFailedError(f"cannot make a scratch folder for the method: {error}") from error
        try:
            hide_this_process()
            self._start(self._with_compiled(wall))
        except OSError as error:
            self._close()
            raise HostFailedError(f"cannot start a process for the method: {error}") from error
        self._tree = Tree(self._supervisor.pid)
        self._watcher = threading.Thread(target=self._watch, name="method-watcher", daemon=True)
        self._watcher.start()

    def _with_compiled(self, wall: Wall) -> Wall:
        view, kept = self._scratch.folder / _COMPILED, self._program.compiled
        view.mkdir()
        if kept is None:
            return wall
        with contextlib.suppress(OSError):  # without a folder for caches, every start compiles
            kept.mkdir(parents=True, exist_ok=True)
            compiled_cache.lay_out(kept, view)
        return replace(wall, read=(*wall.read, kept))

    def _start(self, wall: Wall) -> None:
        program = self._program
        rulesets = wall.rulesets(self._scratch.folder)
        self._ends = ends = _Ends.made()
        request, reply, output, report = ends.theirs
        try:
            self._supervisor = subprocess.Popen(  # noqa: S603
                [
                    sys.executable,
                    "-P",
                    "-m",
                    "taskslam.processes.supervisor",
                    str(os.getpid()),
                    "shm" if wall.shared_memory else "-",
                    ",".join(map(str, rulesets)) or "-",
                    str(report),
                    program.module,
                    str(request),
                    str(reply),
                    *program.arguments,
                ],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                cwd=self._scratch.folder,
                env=_environment(self._scratch.folder, program.local),
                pass_fds=[request, reply, report, *rulesets, *program.inherit],
                start_new_session=True,
            )
        finally:
            ends.close_theirs()
            for ruleset in rulesets:
                os.close(ruleset)

    @property
    def files(self) -> Scratch:
        """The scratch folder, to put files there and to fetch them."""
        return self._scratch

    @property
    def ended(self) -> bool:
        """Whether `end` was called."""
        return self._ends.request < 0

    @property
    def pid(self) -> int:
        """Of the guest's own process, once the supervisor has told it; waits for that. 0 if it never came to be."""
        if self._guest < 0 and self._ends.report >= 0:
            told = os.read(self._ends.report, REPORT.size)
            self._guest = REPORT.unpack(told)[0] if len(told) == REPORT.size else 0
            with contextlib.suppress(OSError):
                self._handle = os.pidfd_open(self._guest) if self._guest else -1
        return max(0, self._guest)

    def write(self, data: bytearray) -> None:
        """Write what the pipe takes and remove it from `data`. A dead child is not an error here but in `exchange`."""
        if not data:
            return
        try:
            while data:
                del data[: os.write(self._ends.request, data)]
        except BlockingIOError:
            pass
        except BrokenPipeError:
            data.clear()
        self._thaw()

    def exchange(self, data: bytearray, patience: Patience) -> bytes | None:
        """Write `data` and wait for a reply: its bytes, empty once the child is dead, None once patience is over."""
        while True:
            self.write(data)
            with contextlib.suppress(BlockingIOError):
                return os.read(self._ends.reply, _PIPE_SIZE)
            if self._supervisor.poll() is not None:
                return b""
            remaining = patience.look()
            if not remaining:
                return None
            poller = select.poll()
            poller.register(self._ends.reply, select.POLLIN)
            if data:
                poller.register(self._ends.request, select.POLLOUT)
            # It may have frozen just after the data came: what is waited for must not sleep.
            self._thaw()
            poller.poll(min(remaining, _THAW_PERIOD_S if self.freezes_itself else _ANSWER_PERIOD_S) * 1000)

    def _thaw(self) -> None:
        if self.freezes_itself and self.pid and self._handle >= 0:
            with contextlib.suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._handle, signal.SIGCONT)

    def keep_compiled(self) -> None:
        """Keep what numba has compiled so far for later starts; right, only as long as nothing measured was written."""
        if self._program.compiled is not None:
            compiled_cache.keep_new(self._scratch.folder / _COMPILED, self._program.compiled)

    def ending(self) -> str:
        """How the child ended, in words: killed by which signal, or exited with which code. Ends it if needed."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._supervisor.wait(timeout=1.0)
        if self.over_memory:
            return f"used more than {self._limits.memory_bytes / 1e6:.0f} MB of memory and was killed"
        code = self._supervisor.poll()
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
        shown = one_line(line, _LONGEST_WORDS)
        return f' after printing "{shown}"' if shown else ""

    def end(self, grace_s: float) -> str:
        """Wait `grace_s` for the child to end by itself, then kill it; all that it started ends with it. Idempotent.

        Returns in words how it ended where that was not by itself and with code 0, else nothing.
        """
        if self.ended:
            return ""
        patience = Patience(grace_s)
        while self._supervisor.poll() is None and (remaining := patience.look()) > 0:
            self._thaw()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._supervisor.wait(min(remaining, _ANSWER_PERIOD_S))
        code = self._supervisor.poll()
        ending = f"did not end within {grace_s:g} s and was killed" if code is None else self.ending() if code else ""
        with undisturbed():
            self._kill()
            self._watcher.join()
            self._close()
        return ending

    def _kill(self) -> None:
        self._supervisor.terminate()
        try:
            self._supervisor.wait(_LAST_RESORT_S)
        except subprocess.TimeoutExpired:
            self._supervisor.kill()
            self._supervisor.wait()
        # Where the guest killed its supervisor, it dies by the kernel's hand, and its group by ours.
        if (guest := self.pid) > 0:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(guest, signal.SIGKILL)
        told = os.read(self._ends.report, REPORT.size)
        self.cpu_s = REPORT.unpack(told)[0] / 1e9 if len(told) == REPORT.size else 0.0

    def _close(self) -> None:
        self._ends.close()
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1
        with contextlib.suppress(OSError):
            self._log.close()
        self._scratch.close()

    def _watch(self) -> None:
        """Thread: keep the log up to its bound, throttle what exceeds it, watch the memory."""
        poller = select.poll()
        poller.register(self._ends.output, select.POLLIN)
        kept = cut = 0
        next_look = 0.0
        alive = listening = True
        while alive or (listening and not cut):
            alive = self._supervisor.poll() is None
            if alive and (now := time.monotonic()) >= next_look:
                self._check_memory()
                next_look = now + _LOOKING_SHARE * (time.monotonic() - now)
            if not listening:
                time.sleep(_WATCH_PERIOD_S)
                continue
            if not poller.poll(_WATCH_PERIOD_S * 1000):
                listening = alive
                continue
            text = os.read(self._ends.output, 1 << 16)
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
        (resident, most), limit = self._tree.memory(), self._limits.memory_bytes
        self.peak_memory = max(self.peak_memory, resident, most)
        if resident > limit and not self.over_memory and self._tree.memory_of_its_own() > limit:
            self.over_memory = True
            self._supervisor.terminate()


def _opened(log: Path) -> BinaryIO:
    try:
        return os.fdopen(os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW, 0o666), "ab")
    except OSError as error:
        raise DiskFullError(f"{log}: cannot write the method's log: {error.strerror}") from error


def _environment(scratch: Path, local: Path | None) -> dict[str, str]:
    environment = {
        key: value for key, value in os.environ.items() if key in _ENVIRONMENT or key.startswith(_ENVIRONMENT_PREFIXES)
    }
    # What the benchmark can import, the child can; the folder in which the user works only if the method lies there.
    here = str(local or working_folder())
    search = [str(Path(entry).resolve()) for entry in sys.path if entry not in ("", here)]
    environment["PYTHONPATH"] = os.pathsep.join([*search, here] if local else search)
    environment.update(dict.fromkeys(("HOME", "TMPDIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME"), str(scratch)))
    environment["NUMBA_CACHE_DIR"] = str(scratch / _COMPILED)
    environment.update(dict.fromkeys(SINGLE_THREADED, "1"))
    return environment
