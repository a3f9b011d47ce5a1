"""`Traveller`: whoever brings the robot to a goal. Our closed loop is one; somebody's navigation stack may be another.

The protocol (`protocol.py`) knows rounds, goals and pauses; how a goal is reached, and by whose SLAM, it leaves to the
traveller. A traveller lives from `start` to `stop`: one round without map, all rounds with map.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from taskslam.geometry import SE2
from taskslam.outcomes import Outcome


@dataclass(frozen=True, slots=True)
class Journey:
    """How the way to a goal ended; detail: where and why, in a sentence."""

    outcome: Outcome
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Poses:
    """Where the robot is, thinks it is, and has counted itself to be; all in `map`, None where it is not known."""

    truth: SE2 | None
    estimate: SE2 | None
    odometry: SE2 | None


@dataclass(frozen=True, slots=True)
class Effort:
    """What a traveller's life has taken so far.

    frames: sensor frames offered to SLAM, dropped_frames: those that it never saw; compute_s: processor seconds of
    SLAM; peak_memory: bytes. Known once it was stopped: cpu_s, processor seconds of all processes of SLAM from start to
    end, and stop_failure, how SLAM failed while it was stopped.
    """

    frames: int = 0
    dropped_frames: int = 0
    compute_s: float = 0.0
    peak_memory: int = 0
    cpu_s: float = 0.0
    stop_failure: str = ""


class Traveller(Protocol):
    """Goes to goals. Raises MethodFailedError wherever its SLAM method has failed; then only `poses`, `stop` follow."""

    def start(self, still_s: float) -> None:
        """Begin from nothing at the start pose, and stand still there for at least so many simulated seconds."""

    def begin_round(self, number: int) -> None:
        """What is recorded from now on belongs to this round; counted from 0 over the run."""

    def go_to(self, goal: SE2) -> Journey:
        """Drive to `goal` in `map` until it is reached, or cannot be. The robot stands when this returns."""

    def wait(self, seconds: float) -> None:
        """Stand still for so many simulated seconds; sensors and SLAM go on."""

    def poses(self) -> Poses:
        """True, SLAM-based and odometry pose of this instant."""

    def effort(self) -> Effort:
        """What it has taken so far."""

    def stop(self) -> None:
        """The life is over. May be called more than once."""
