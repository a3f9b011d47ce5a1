"""The process of a foreign node: started apart from our own Python, heard, timed, and ended."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from taskslam.errors import InputError
from taskslam.printable import one_line
from taskslam.processes.guest import STARTED_AGAIN

_LAST_LINES = 6
_LONGEST_LINE = 200
_POLITE_S = 1.0  # from SIGINT to SIGKILL
_OURS = ("PYTHONPATH", "PYTHONHOME", "PYTHONHASHSEED", "VIRTUAL_ENV", "NUMBA_CACHE_DIR")
_LOOKED_AT = 4096
_CPU_OF_PROCESS = 2  # Linux's clock of a process's processor time: the pid, inverted, above these bits


class NodeProcess:
    """A started node. command, setup, variables, ours: as for `program`.

    What it prints goes on to our own output, and its last lines are kept. Raises InputError: it cannot be started.
    """

    def __init__(
        self, command: Sequence[str], setup: str | None, variables: Mapping[str, str], ours: bool = False
    ) -> None:
        self._lines: deque[str] = deque(maxlen=_LAST_LINES)
        words, environment = program(command, setup, variables, ours)
        try:
            self._process = subprocess.Popen(  # noqa: S603
                words,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,
            )
        except OSError as error:
            raise InputError(f"the node cannot be started: {error}") from error
        self._reader = threading.Thread(target=self._read, name="reads the node", daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Of the process that was started."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    def ending(self) -> str:
        """How it ended, in words, with its last lines."""
        code = self._process.poll()
        self._reader.join(0.5)
        how = "has closed its output" if code is None else f"exited with code {code}"
        if code is not None and code < 0:
            how = f"was killed by {signal.Signals(-code).name}"
        said = " | ".join(self._lines)
        return f"the node {how}" + (f' after printing "{said}"' if said else " without a word")

    def end(self) -> None:
        """Ask it to end, and kill what is left of its session."""
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_POLITE_S)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for raw in self._process.stdout:
            sys.stdout.buffer.write(raw)
            sys.stdout.buffer.flush()
            if line := one_line(raw.decode(errors="replace").strip(), _LONGEST_LINE):
                self._lines.append(line)


def program(
    command: Sequence[str], setup: str | None, variables: Mapping[str, str], ours: bool = False
) -> tuple[list[str], dict[str, str]]:
    """The words that start a program apart from our own Python, and its environment. ours: it is one of our Python's.

    setup: a script that bash sources before; variables: win over all others. Raises InputError: there is no such file.
    """
    environment = _environment(ours) | dict(variables)
    if not setup and shutil.which(command[0], path=environment["PATH"]) is None:
        raise InputError(f"the node's command '{command[0]}': there is no such program, or it cannot be executed")
    if setup and not os.access(setup, os.R_OK):
        raise InputError(f"the node's setup '{setup}': there is no such file, or it cannot be read")
    sourced = ["bash", "-c", '. "$0" && exec env "$@"', setup] if setup else ["env"]
    told = [f"{name}={value}" for name, value in variables.items()]
    return [*sourced, *told, *command], environment


def processor_time(processes: Collection[int]) -> int:
    """Used by these processes so far, ns; by one that has ended none. By the kernel's clocks."""
    used = 0
    for process in processes:
        with contextlib.suppress(OSError):
            used += time.clock_gettime_ns(~process << 3 | _CPU_OF_PROCESS)
    return used


def session_of(leader: int) -> list[int]:
    """The processes of a session, by asking for every id from its leader's on: of /proc, a wall may show us our own."""
    return [process for process in range(leader, leader + _LOOKED_AT) if _session(process) == leader]


def _session(process: int) -> int:
    try:
        return os.getsid(process)
    except OSError:
        return 0


def _environment(ours: bool) -> dict[str, str]:
    """This process's; without what belongs to our Python, where a program has its own, and else with its programs."""
    environment = {name: value for name, value in os.environ.items() if name not in _OURS}
    if ours:
        beside = str(Path(sys.executable).parent)
        return environment | {"PATH": os.pathsep.join([beside, environment.get("PATH", os.defpath)])}
    environment.pop(STARTED_AGAIN, None)
    prefixes = {Path(prefix) for prefix in (sys.prefix, sys.exec_prefix) if prefix != sys.base_prefix}
    for name in ("PATH", "LD_LIBRARY_PATH"):
        entries = environment.get(name, os.defpath if name == "PATH" else "").split(os.pathsep)
        kept = [entry for entry in entries if entry and not prefixes & {Path(entry), *Path(entry).parents}]
        environment[name] = os.pathsep.join(kept)
    return environment
