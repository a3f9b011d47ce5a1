"""Whether ORB-SLAM3 is in the map that began at the robot's start.

When ORB-SLAM3 has been lost for three seconds, or early on at once, it begins a new map with its origin at the next
frame, and reports `OK` again. No signal of the package tells (`pose_valid` is true in both maps), and the new origin
has nothing to do with the old one, unless place recognition later merges the maps: then the new one is moved into the
old one's frame.

The active map's own keyframes tell: a map keeps its first keyframe, whatever is culled, merged or optimised, and the
start map's first keyframe is stamped with the first frame that was tracked. So after any frame that was not `OK`, poses
count only once the active map's earliest keyframe is that one again.
"""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from taskslam.measurements import NANOSECONDS

_LOOK_EVERY = NANOSECONDS // 2
_SAME_FRAME_S = 1e-3  # the trajectory file keeps microseconds


class KeyframeSource(Protocol):
    """What this file needs of the package."""

    def save_keyframe_trajectory_tum(self, filename: str) -> None:
        """Write the active map's keyframes, one a line, the stamp in seconds first."""


class StartMap:
    """Judges frame by frame. file: scratch file for the keyframes."""

    def __init__(self, source: KeyframeSource, file: Path) -> None:
        self._source = source
        self._file = file
        self._began: int | None = None
        self._in_doubt = False
        self._next_look = 0

    @property
    def began(self) -> bool:
        """Whether any frame has been tracked."""
        return self._began is not None

    def holds(self, tracked: bool, stamp: int) -> bool:
        """Whether the pose of the frame stamped `stamp` (ns) is one in the start map. tracked: its state is `OK`."""
        if not tracked:
            self._in_doubt = self.began
            self._next_look = 0
            return False
        if self._began is None:
            self._began = stamp
        if self._in_doubt and stamp >= self._next_look:
            self._next_look = stamp + _LOOK_EVERY
            self._in_doubt = not self._is_active()
        return not self._in_doubt

    def _is_active(self) -> bool:
        assert self._began is not None
        self._source.save_keyframe_trajectory_tum(str(self._file))
        stamps = [float(line.split()[0]) for line in self._file.read_text(encoding="ascii").splitlines() if line]
        return bool(stamps) and abs(min(stamps) - self._began / NANOSECONDS) < _SAME_FRAME_S
