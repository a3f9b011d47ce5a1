"""The processes below one: found by their parents, and what memory they hold together."""

from __future__ import annotations

import contextlib
import os
import time
from collections import defaultdict

from taskslam.processes.memory import kilobytes

_LOOK_EVERY_S = 0.2


def parents() -> dict[int, int]:
    """The parent of every process that can be seen, by process id."""
    found = {}
    for name in os.listdir("/proc"):  # noqa: PTH208 a path for each would take longer than all the rest
        if name.isdecimal():
            with contextlib.suppress(OSError, ValueError, IndexError):  # it ended just now
                found[int(name)] = int(_read(f"/proc/{name}/stat").rpartition(b")")[2].split(maxsplit=2)[1])
    return found


def children_of(process: int) -> list[int]:
    """Processes whose parent this one is."""
    return [child for child, parent in parents().items() if parent == process]


class Tree:
    """All processes below `root`, which is not counted itself: a supervisor."""

    def __init__(self, root: int) -> None:
        self._root = root
        self._newest = b""
        self._looked = -_LOOK_EVERY_S
        self._members: list[int] = []

    def members(self) -> list[int]:
        """Their process ids. Looked for only if any process was made since anywhere, and a few times a second."""
        if (now := time.monotonic()) - self._looked < _LOOK_EVERY_S:
            return self._members
        self._looked, newest = now, _newest_process()
        if newest != self._newest or not newest:
            below: dict[int, list[int]] = defaultdict(list)
            for child, parent in parents().items():
                below[parent].append(child)
            members, front = list[int](), [self._root]
            while front:
                front = [child for parent in front for child in below[parent]]
                members += front
            self._newest, self._members = newest, members
        return self._members

    def memory(self) -> tuple[int, int]:
        """Bytes resident in all of them, pages that several share once for each; and the most that was in any one."""
        held = [_resident(member) for member in self.members()]
        return sum(now for now, _ in held), max((most for _, most in held), default=0)

    def memory_of_its_own(self) -> int:
        """Bytes resident in all of them, shared pages divided among their holders: exact, and slow to learn."""
        return sum(map(_proportional, self.members()))


def _newest_process() -> bytes:
    """What changes with every process that is made; empty where the kernel does not tell."""
    try:
        return _read("/proc/loadavg").rpartition(b" ")[2]
    except OSError:
        return b""


def _resident(process: int) -> tuple[int, int]:
    """Bytes resident now, and at most so far."""
    try:
        status = _read(f"/proc/{process}/status")
        return kilobytes(status, b"VmRSS:"), kilobytes(status, b"VmHWM:")
    except (OSError, ValueError):  # it ended just now
        return 0, 0


def _proportional(process: int) -> int:
    try:
        return kilobytes(_read(f"/proc/{process}/smaps_rollup"), b"\nPss:")
    except (OSError, ValueError):
        return _resident(process)[0]


def _read(file: str) -> bytes:
    with open(file, "rb") as opened:  # noqa: PTH123 read fifty times a second
        return opened.read()
