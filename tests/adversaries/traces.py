"""What adversaries may use here, how many are tried, and what they could leave behind."""

from __future__ import annotations

import gc
import os
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

from taskslam.processes.guest import Limits
from taskslam.processes.tree import children_of

TORTURE = bool(os.environ.get("TASKSLAM_TORTURE"))
LIMITS = Limits(10.0, 30.0, 1.0, memory_bytes=700 << 20, log_bytes=1 << 16)


def impatient(place: str) -> Limits:
    """Limits that tell a hang at this place soon, and leave a busy machine its time at all others."""
    soon = {"feed": {"frame_timeout_s": 1.0}, "start": {"start_timeout_s": 2.5}, "construct": {"start_timeout_s": 2.5}}
    return replace(LIMITS, **soon.get(place, {}))


# Shared memory of others: what `sharing.py` leaves in its own process, and ROS 2 in a test that runs beside this one.
_OTHERS = ("left-behind", "fastdds_", "fastrtps_", "sem.fastdds_", "sem.fastrtps_", "lttng-")


@dataclass(frozen=True)
class Traces:
    """What could be left behind: processes below this one, its descriptors, scratch folders, shared memory."""

    children: frozenset[int]
    descriptors: int
    scratch: frozenset[str]
    shared: frozenset[str]

    @classmethod
    def now(cls) -> Traces:
        """As it is, once what earlier tests forgot is collected."""
        gc.collect()
        scratch = frozenset(path.name for path in Path(tempfile.gettempdir()).glob("taskslam-*"))
        shared = frozenset(path.name for path in Path("/dev/shm").iterdir() if not path.name.startswith(_OTHERS))
        descriptors = len(list(Path("/proc/self/fd").iterdir()))
        return cls(frozenset(children_of(os.getpid())), descriptors, scratch, shared)

    def beyond(self, before: Traces) -> list[str]:
        """What is here and was not before. What others let go of meanwhile does not count."""
        left = [f"process {child}" for child in self.children - before.children]
        left += sorted(self.scratch - before.scratch) + sorted(self.shared - before.shared)
        more = self.descriptors - before.descriptors
        return left + ([f"{more} descriptors"] if more > 0 else [])
