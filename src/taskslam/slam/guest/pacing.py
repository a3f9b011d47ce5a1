"""Wall time in step with simulated time, for methods with threads of their own (design D3).

A robot's mapping thread has one frame period of the robot's time between two frames, whatever the machine that runs
the simulator does meanwhile. So here: the time between two frames' stamps, divided by `cpu_scale`, is the wall time
that the method's process gets from taking the one to taking the other.

- Used up, and no next frame yet (a slow simulator): the process freezes itself with SIGSTOP; the host wakes it with
  SIGCONT when it writes.
- A next frame, but time left (a fast simulator): it is not taken until the time is used up, or until all other threads
  sleep without having worked.

Time in which threads were ready to run and got no core is given back, where the kernel tells (`schedstat`): a method
shall not suffer from a simulator that takes the cores. It is the mean over the threads, each with the weight of the
time in which it wanted a core: with the longest wait of all, the other threads would get more than their period.
"""

from __future__ import annotations

import os
import select
import signal
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from taskslam.measurements import NANOSECONDS

LONGEST_PERIOD = 5 * NANOSECONDS
"""What a method gets at most between two frames: a long gap in a recording is not waited for."""

_LOOK_EVERY_S = 0.001
_QUIET_FOR = 6_000_000  # ns: longer than the naps between two looks for work of ORB-SLAM3's threads (3 and 5 ms)
_QUIET_SHARE = 0.1  # of one core; looking for work costs less, work more
_TASKS = Path("/proc/self/task")

_Shares: TypeAlias = dict[str, tuple[int, int]]


@dataclass(slots=True)
class _Lull:
    """Since when (ns of the monotonic clock) the other threads have seemed to sleep, and their CPU time then (ns)."""

    since: int
    worked: int


class Pacer:
    """The clock of one method's process; used by the thread that feeds the method.

    cpu_scale: robot's compute time per second of this machine's.
    """

    def __init__(self, cpu_scale: float) -> None:
        self._cpu_scale = cpu_scale
        self._stamp: int | None = None
        self._period = 0
        self._began = time.monotonic_ns()
        self._frozen = 0
        self._shares = _shares()

    def take_frame(self, stamp: int) -> None:
        """Wait until the period before the frame stamped `stamp` (ns) is over for the method; begin the next."""
        if self._stamp is not None:
            self._period = min(max(0, round((stamp - self._stamp) / self._cpu_scale)), LONGEST_PERIOD)
            self._let_work()
        self._stamp = stamp
        self._began, self._frozen, self._shares = time.monotonic_ns(), 0, _shares()

    def used(self) -> int:
        """Wall time in ns that the method's own threads have had since `take_frame`."""
        return self._elapsed(own=False)

    def took(self) -> int:
        """Wall time in ns that the frame has taken since `take_frame` on cores that nobody else wanted."""
        return self._elapsed(own=True)

    def _elapsed(self, own: bool) -> int:
        shares = _shares()
        if not own:  # while this thread waits for a core, the others may run
            shares.pop(str(threading.get_native_id()), None)
        return time.monotonic_ns() - self._began - self._frozen - _mean_wait(shares, self._shares)

    def rest(self, request: int) -> None:
        """Return once there is something to read from `request`; frozen from the moment that the period is used up."""
        poller = select.poll()
        poller.register(request, select.POLLIN)
        while not poller.poll(max(0.0, (self._period - self.used()) / 1e6) if self._period else None):
            if self.used() >= self._period:
                before = time.monotonic_ns()
                os.kill(os.getpid(), signal.SIGSTOP)
                self._frozen += time.monotonic_ns() - before

    def _let_work(self) -> None:
        lull = _Lull(time.monotonic_ns(), _work_of_others())
        while self.used() < self._period:
            time.sleep(_LOOK_EVERY_S)
            now, worked = time.monotonic_ns(), _work_of_others()
            if _others_runnable() or worked - lull.worked > _QUIET_SHARE * _QUIET_FOR:
                lull = _Lull(now, worked)
            elif now - lull.since >= _QUIET_FOR:
                return


def _work_of_others() -> int:
    """CPU time in ns of all threads but this one."""
    return time.process_time_ns() - time.thread_time_ns()


def _others_runnable() -> bool:
    """Whether any other thread runs, wants to, or waits for a disk."""
    own = str(threading.get_native_id())
    return any(thread != own and _state(thread) in "RD" for thread in os.listdir(_TASKS))  # noqa: PTH208 - quick


def _state(thread: str) -> str:
    try:
        with open(_TASKS / thread / "stat", "rb") as file:  # noqa: PTH123
            return chr(file.read().rpartition(b") ")[2][0])
    except (OSError, IndexError):  # it ended just now
        return "X"


def _mean_wait(now: _Shares, before: _Shares) -> int:
    """For how many ns a thread that wanted a core had none; mean over threads, weighted by how long they wanted one."""
    waited = wanted = 0
    for thread, (ran, delay) in now.items():
        ran_before, delay_before = before.get(thread, (0, 0))
        own, wish = delay - delay_before, ran - ran_before + delay - delay_before
        waited, wanted = waited + own * wish, wanted + wish
    return waited // wanted if wanted else 0


def _shares() -> _Shares:
    """Per thread the ns that it has run and waited for a core so far; empty where the kernel does not count them."""
    shares: _Shares = {}
    for thread in os.listdir(_TASKS):  # noqa: PTH208 - quick
        try:
            with open(_TASKS / thread / "schedstat", "rb") as file:  # noqa: PTH123
                ran, delay, _ = file.read().split()
                shares[thread] = int(ran), int(delay)
        except (OSError, ValueError, IndexError):
            continue
    return shares
