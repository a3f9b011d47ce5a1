"""What the kernel is asked so that a method cannot outlive the benchmark, nor look into it.

See docs/decisions/004-method-processes.md for what this wall holds and what it does not.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import resource
import signal
from pathlib import Path

_PR_SET_PDEATHSIG = 1
_PR_SET_DUMPABLE = 4
_PR_SET_NO_NEW_PRIVS = 38
_CAPABILITY_VERSION_3 = 0x20080522
_OOM_FIRST_VICTIM = "1000"


def hide_this_process() -> None:
    """Host side: no process of this user may read this one's memory, descriptors, environment or working directory.

    The kernel then also refuses core dumps of, and debuggers on, this process.
    """
    _prctl(_PR_SET_DUMPABLE, 0)


def die_with_parent(parent: int) -> None:
    """The kernel kills this process when the thread of `parent` (pid) that started it ends.

    Raises:
        ProcessLookupError: the parent is gone already.
    """
    _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        raise ProcessLookupError(f"process {parent}, which started this one, is gone")


def confine_this_process(parent: int) -> None:
    """Child side, before any foreign code runs: die with `parent` (pid), leave no core dump, hold no privilege.

    Raises:
        ProcessLookupError: the parent is gone already.
    """
    die_with_parent(parent)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(_OOM_FIRST_VICTIM, encoding="ascii")
    _prctl(_PR_SET_NO_NEW_PRIVS, 1)
    _drop_capabilities()


def _prctl(option: int, value: int) -> None:
    if ctypes.CDLL(None, use_errno=True).prctl(option, value, 0, 0, 0) != 0:
        error = ctypes.get_errno()
        raise OSError(error, f"prctl({option}, {value}): {os.strerror(error)}")


def _drop_capabilities() -> None:
    """As root (in containers) the kernel would let a child read its parent by capability; without them it asks."""
    header = (ctypes.c_uint32 * 2)(_CAPABILITY_VERSION_3, 0)
    nothing = (ctypes.c_uint32 * 6)()
    ctypes.CDLL(None, use_errno=True).capset(header, nothing)
