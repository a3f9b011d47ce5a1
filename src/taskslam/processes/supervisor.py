"""Between the host and a guest: `python -P -m taskslam.processes.supervisor PARENT MEMORY RULESETS REPORT MODULE ...`.

The supervisor makes the guest's process, confined before it loads anything, and adopts whatever that leaves behind. It
ends when the guest's own process has ended, or when the host asks or is gone: then it kills all that is left, until
nothing is, and ends as the guest did, by the same signal or code.

It imports nothing but the standard library: the guest is made by a fork, and starts from nothing.

Arguments: the host's process id; whether the guest may have shared memory (`shm` or `-`); descriptors of the rulesets
to enter, the widest first, separated by commas, or `-`; the descriptor on which the guest's process id is told, and at
its end how much processor time all its processes have used, in ns; the guest's module, and the arguments for that.
"""

from __future__ import annotations

import contextlib
import os
import runpy
import signal
import struct
import sys
from pathlib import Path

from taskslam.processes import landlock
from taskslam.processes.confine import (
    SHARED_MEMORY,
    adopt_orphans,
    confine_this_process,
    die_with_parent,
    hide_this_process,
    no_core_dump,
    private_shared_memory,
)
from taskslam.processes.tree import children_of

REPORT = struct.Struct("<q")
_WAIT_S = 0.05
_ENDERS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


def main(arguments: list[str]) -> None:
    """Start the guest, and see to its end."""
    parent, memory, rulesets, report, module, *rest = arguments
    signal.pthread_sigmask(signal.SIG_BLOCK, {*_ENDERS, signal.SIGCHLD})
    die_with_parent(int(parent), signal.SIGTERM)
    adopt_orphans()
    walls = [int(number) for number in rulesets.split(",") if number != "-"]
    me = os.getpid()
    guest = os.fork()
    if guest == 0:
        os.close(int(report))
        _become_guest(me, memory == "shm", walls)
        sys.argv = [module, *rest]
        runpy.run_module(module, run_name="__main__", alter_sys=True)
        return
    _supervise(guest, int(report))


def _become_guest(supervisor: int, shared_memory: bool, walls: list[int]) -> None:
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {*_ENDERS, signal.SIGCHLD})
    os.setsid()
    if shared_memory:
        private_shared_memory()
    confine_this_process(supervisor)
    if walls:
        landlock.allow_reading(walls[-1], Path("/proc/self"))
        if shared_memory:
            landlock.allow_all(walls[-1], SHARED_MEMORY)
    for wall in walls:
        landlock.enter(wall)
        os.close(wall)


def _supervise(guest: int, report: int) -> None:
    hide_this_process()
    keep = {report}
    for descriptor in [int(entry.name) for entry in Path("/proc/self/fd").iterdir()]:
        if descriptor not in keep:
            with contextlib.suppress(OSError):
                os.close(descriptor)
    _tell(report, guest)
    status = _wait_for(guest)
    _end_all()
    used = os.times()
    _tell(report, round((used.children_user + used.children_system) * 1e9))
    _end_like(status)


def _tell(report: int, number: int) -> None:
    with contextlib.suppress(OSError):  # a host that is gone need not know
        os.write(report, REPORT.pack(number))


def _wait_for(guest: int) -> int:
    """Until the guest's own process has ended; its status. What others leave behind is reaped meanwhile."""
    while True:
        if signal.sigwaitinfo({*_ENDERS, signal.SIGCHLD}).si_signo in _ENDERS:
            os.kill(guest, signal.SIGKILL)
        while (ended := os.waitpid(-1, os.WNOHANG))[0]:
            if ended[0] == guest:
                return ended[1]


def _end_all() -> None:
    """Kill every process below this one until there is none; one that is killed leaves its own children to us."""
    while True:
        for child in children_of(os.getpid()):
            with contextlib.suppress(ProcessLookupError):
                os.kill(child, signal.SIGKILL)
        try:
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        except ChildProcessError:
            return
        signal.sigtimedwait({signal.SIGCHLD}, _WAIT_S)


def _end_like(status: int) -> None:
    code = os.waitstatus_to_exitcode(status)
    if code >= 0:
        os._exit(code)
    no_core_dump()
    ender = -code
    if ender != signal.SIGKILL:
        signal.signal(ender, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {ender})
    os.kill(os.getpid(), ender)
    os._exit(128 + ender)


if __name__ == "__main__":
    main(sys.argv[1:])
