"""What of this machine is lent to which run: cores and memory, in the order in which runs ask for them."""

from __future__ import annotations

import contextlib
import os
from collections import deque
from collections.abc import Iterator
from threading import Condition

from taskslam.benchmark.resources import GIGABYTE, Share
from taskslam.errors import InputError

_KEPT_FREE = 0.05  # of the machine's memory, for whoever else lives there


class Allotment:
    """Lends cores and memory; who asks waits until all that was asked for is free.

    cores: at most so many are lent at a time. Where they are all that this process may use, each run has its own, and
    is kept on them, so that none disturbs another; with fewer, which ones is left to the system, since other work may
    be kept on the same.
    """

    def __init__(self, cores: int) -> None:
        own = sorted(os.sched_getaffinity(0))
        self._cores = cores
        self._free = set(own) if cores == len(own) else set(range(-cores, 0))  # below 0: any core
        self._memory = self._all_memory = usable_memory()
        self._waiting: deque[object] = deque()
        self._changed = Condition()

    @contextlib.contextmanager
    def lent(self, share: Share) -> Iterator[frozenset[int]]:
        """The cores to be kept on, empty for any; for as long as the block lasts.

        A run that asks for more cores than there are is given all of them. Raises InputError: for more memory.
        """
        if share.memory_bytes > self._all_memory:
            raise InputError(
                f"asks for {share.memory:g} GB of memory, and this machine has {self._all_memory / GIGABYTE:.1f} GB for"
                " runs (`resources: memory` in the campaign's file)"
            )
        count, ticket = min(share.cores, self._cores), object()
        with self._changed:
            self._waiting.append(ticket)
            self._changed.wait_for(lambda: self._is_next(ticket, count, share.memory_bytes))
            self._waiting.popleft()
            cores = frozenset(sorted(self._free)[:count])
            self._free -= cores
            self._memory -= share.memory_bytes
            self._changed.notify_all()
        try:
            yield frozenset(core for core in cores if core >= 0)
        finally:
            with self._changed:
                self._free |= cores
                self._memory += share.memory_bytes
                self._changed.notify_all()

    def _is_next(self, ticket: object, cores: int, memory: int) -> bool:
        return self._waiting[0] is ticket and len(self._free) >= cores and self._memory >= memory


def usable_memory() -> int:
    """Bytes that runs may take here: of the machine, or of the control group that this process is in."""
    machine = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    limits = [machine]
    for file in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        with contextlib.suppress(OSError, ValueError), open(file, encoding="ascii") as limit:  # noqa: PTH123 short
            limits.append(int(limit.read()))
    return round(min(limits) * (1 - _KEPT_FREE))
