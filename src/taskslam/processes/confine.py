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
_PR_SET_CHILD_SUBREAPER = 36
_PR_SET_NO_NEW_PRIVS = 38
_CAPABILITY_VERSION_3 = 0x20080522
_OOM_FIRST_VICTIM = "1000"
_CLONE_NEWNS, _CLONE_NEWUSER = 0x00020000, 0x10000000
_MS_REC, _MS_PRIVATE = 0x4000, 0x40000
SHARED_MEMORY = Path("/dev/shm")  # noqa: S108 a place, not a file for temporary use


def hide_this_process() -> None:
    """Host side: no process of this user may read this one's memory, descriptors, environment or working directory.

    The kernel then also refuses core dumps of, and debuggers on, this process.
    """
    _prctl(_PR_SET_DUMPABLE, 0)


def die_with_parent(parent: int, by: signal.Signals = signal.SIGKILL) -> None:
    """The kernel sends `by` to this process when the thread of `parent` (pid) that started it ends.

    Raises:
        ProcessLookupError: the parent is gone already.
    """
    _prctl(_PR_SET_PDEATHSIG, by)
    if os.getppid() != parent:
        raise ProcessLookupError(f"process {parent}, which started this one, is gone")


def adopt_orphans() -> None:
    """A process below this one whose parent ends becomes a child of this one, and not of the system's first."""
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)


def no_core_dump() -> None:
    """Not of this process, nor of any that it starts."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def private_shared_memory() -> bool:
    """Give this process a /dev/shm that nobody else sees, where the kernel lets it; whether it did.

    Call it before `confine_this_process`: it asks for privilege, within a user namespace where there is none.
    """
    me, group = os.getuid(), os.getgid()
    if _unshare(_CLONE_NEWNS) != 0:
        if _unshare(_CLONE_NEWUSER | _CLONE_NEWNS) != 0:
            return False
        for file, line in (("setgroups", "deny"), ("uid_map", f"{me} {me} 1"), ("gid_map", f"{group} {group} 1")):
            with contextlib.suppress(OSError):
                Path(f"/proc/self/{file}").write_text(line, encoding="ascii")
        _prctl(_PR_SET_DUMPABLE, 1)
    return _mount(b"none", b"/", b"", _MS_REC | _MS_PRIVATE) and _mount(b"tmpfs", bytes(SHARED_MEMORY), b"tmpfs", 0)


def can_have_private_shared_memory() -> bool:
    """Whether `private_shared_memory` works here: tried in a process of its own."""
    if (child := os.fork()) == 0:
        try:
            os._exit(0 if private_shared_memory() else 1)
        finally:
            os._exit(2)
    return os.waitpid(child, 0)[1] == 0


def confine_this_process(parent: int) -> None:
    """Child side, before any foreign code runs: die with `parent` (pid), leave no core dump, hold no privilege.

    Raises:
        ProcessLookupError: the parent is gone already.
    """
    die_with_parent(parent)
    no_core_dump()
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(_OOM_FIRST_VICTIM, encoding="ascii")
    _prctl(_PR_SET_NO_NEW_PRIVS, 1)
    _drop_capabilities()


def _prctl(option: int, value: int) -> None:
    if ctypes.CDLL(None, use_errno=True).prctl(option, value, 0, 0, 0) != 0:
        error = ctypes.get_errno()
        raise OSError(error, f"prctl({option}, {value}): {os.strerror(error)}")


def _unshare(flags: int) -> int:
    return int(ctypes.CDLL(None, use_errno=True).unshare(flags))


def _mount(source: bytes, target: bytes, kind: bytes, flags: int) -> bool:
    return bool(ctypes.CDLL(None, use_errno=True).mount(source, target, kind, ctypes.c_ulong(flags), None) == 0)


def _drop_capabilities() -> None:
    """As root (in containers) the kernel would let a child read its parent by capability; without them it asks."""
    header = (ctypes.c_uint32 * 2)(_CAPABILITY_VERSION_3, 0)
    nothing = (ctypes.c_uint32 * 6)()
    ctypes.CDLL(None, use_errno=True).capset(header, nothing)
