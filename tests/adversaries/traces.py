"""What adversaries may use here, how many are tried, and what they could leave behind."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

from taskslam.processes.guest import Limits
from taskslam.processes.tree import children_of

TORTURE = bool(os.environ.get("TASKSLAM_TORTURE"))
LIMITS = Limits(1.0, 2.5, 1.0, memory_bytes=700 << 20, log_bytes=1 << 16)


@dataclass(frozen=True)
class Traces:
    """What could be left behind: processes below this one, its descriptors, scratch folders, shared memory."""

    children: frozenset[int]
    descriptors: int
    scratch: frozenset[str]
    shared: frozenset[str]

    @classmethod
    def now(cls) -> Traces:
        """As it is."""
        scratch = frozenset(path.name for path in Path(tempfile.gettempdir()).glob("taskslam-*"))
        shared = frozenset(path.name for path in Path("/dev/shm").iterdir()) - {"left-behind"}  # of `sharing.py`
        descriptors = len(list(Path("/proc/self/fd").iterdir()))
        return cls(frozenset(children_of(os.getpid())), descriptors, scratch, shared)
