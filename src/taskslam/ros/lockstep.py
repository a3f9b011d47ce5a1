"""A foreign node in step with simulated time: the rules, and nothing of any transport.

A node has threads, timers and queues of its own and believes in /clock. What keeps its answers the same on any machine
was learned with real nodes:

- The clock never goes back, over all rounds of a life: what is older than it does not move it.
- Transforms up to the stamp of a sensor's message come first, then the clock at that stamp, then the message.
- While an answer is waited for, the clock goes on in small ticks, since a node may sleep in simulated time; it stays
  below the stamp of the next frame.
- An answer belongs to the frame in whose sweep its stamp falls, from the stamp that the frame's message bears to the
  instant at which it was complete (the same for most), whenever it comes. One of no frame is counted, and one of the
  future is none.
- A frame without an answer is counted and passed over: after a long time on the wall's clock, so that a slow machine is
  no slow node, or, where a node may be silent, once it has nothing left to do. While we ourselves
  were stopped (a job that is suspended, a laptop that sleeps) no time has passed.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Any, Protocol

from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS
from taskslam.processes.patience import Patience
from taskslam.slam.base import InvalidOutputError, StalledError

SAME = 1_000  # ns: nodes that keep a stamp as a double of seconds lose the last digits
_MOST_OPEN = 1_000  # frames without an answer that are remembered
_NEVER = -1
_QUIET_SHARE = 0.1  # of one core: what looking for work costs a node that has none
_LONGEST_LOOK_S = 0.05  # a look for answers that took longer found us stopped, and most likely the node too


class Answers(StrEnum):
    """Whether a node says something to every frame, or only where it sees fit."""

    EVERY_FRAME = "every_frame"
    SPARSE = "sparse"


@dataclass(frozen=True, slots=True)
class Rules:
    """How a node is waited for.

    silent_start: ns from the first frame of a life in which frames may have no answer, though every later one has.
    tick: ns of simulated time, and every_s: s on the wall's clock from one tick to the next. longest_s: on the wall's
    clock for one answer. in_a_row: so many frames without an answer end it, where every frame has one. quiet_s: with
    next to no work for so long after the last tick, a node that may be silent has nothing to say.
    """

    answers: Answers = Answers.EVERY_FRAME
    silent_start: int = 0
    tick: int = 2_000_000
    every_s: float = 0.001
    longest_s: float = 10.0
    in_a_row: int = 10
    quiet_s: float = 0.1


@dataclass(frozen=True, slots=True)
class Answer:
    """What a node said: the stamp (ns) that it bears, the pose (4, 4), and its covariance (3, 3) or None."""

    stamp: int
    pose: FloatArray
    covariance: FloatArray | None = None


@dataclass(slots=True)
class Counts:
    """Of one life.

    missing: frames without an answer in time; late: answers that came after all, of which nothing was made; unmatched:
    answers with the stamp of no frame, or of one that was answered before.
    """

    frames: int = 0
    answered: int = 0
    missing: int = 0
    late: int = 0
    unmatched: int = 0

    def __str__(self) -> str:
        return ", ".join(f"{getattr(self, field.name)} {field.name}" for field in fields(self))


class Saying(Protocol):
    """What is said to a node of one measurement; the rules look at its instant alone."""

    @property
    def stamp(self) -> int:
        """The measurement's instant."""


class Wire(Protocol):
    """What the rules ask of a transport. Instants are ns of simulated time."""

    def transforms(self, until: int) -> None:
        """Say where the base is at that instant; nothing where no odometry is told."""

    def clock(self, now: int) -> None:
        """Say what time it is."""

    def say(self, saying: Any) -> None:
        """Say what a sensor measured."""

    def hear(self, longest_s: float) -> Sequence[Answer]:
        """What the node has said since the last time, waiting at most so long for the first of it.

        Raises an error of its own for a node that is gone.
        """

    def worked(self) -> float:
        """Processor time of the node so far, s."""


class Lockstep:
    """One node's life: fed in stamp order, frames answered one by one. counts: of all so far.

    now: what the clock shows, `start` before anything is fed. wall: s, a monotonic clock.
    """

    def __init__(self, wire: Wire, rules: Rules, start: int = 0, wall: Callable[[], float] = time.monotonic) -> None:
        self._wire, self._rules, self._wall = wire, rules, wall
        self.now = start
        self.counts = Counts()
        self._open: dict[int, int] = {}  # frames without an answer, oldest first: the stamp they bear, and their end
        self._newest = _NEVER  # end of a frame
        self._first: int | None = None  # the same
        self._in_a_row = 0
        self._strayed: int | None = None  # how far the last answer of no frame was from the newest frame, ns

    def tick(self, below: int) -> bool:
        """Let the clock go on by one tick, if it then is still below that instant; whether it did."""
        if self.now + self._rules.tick >= below:
            return False
        self._show(self.now + self._rules.tick)
        return True

    def stream(self, saying: Saying) -> None:
        """What is not answered: odometry, inertial samples."""
        self._introduce(saying)
        self._wire.say(saying)

    def frame(self, saying: Saying, bears: int, following: int) -> Answer | None:
        """What the node says of a frame, or None. bears: the stamp of its message; following: that of the next frame.

        Raises:
            StalledError: too many frames in a row without an answer.
            InvalidOutputError: an answer of the future.
        """
        self._introduce(saying)
        self._open[bears] = ends = max(bears, saying.stamp)
        while len(self._open) > _MOST_OPEN:
            del self._open[next(iter(self._open))]
        self._newest = max(self._newest, ends)
        if self._first is None:
            self._first = ends
        self.counts.frames += 1
        self._wire.say(saying)
        answer = self._wait_for(bears, following)
        if answer is None:
            self._missed()
        else:
            self._in_a_row = 0
        return answer

    def _introduce(self, saying: Saying) -> None:
        self._wire.transforms(saying.stamp)
        if saying.stamp > self.now:
            self._show(saying.stamp)

    def _show(self, now: int) -> None:
        self.now = now
        self._wire.clock(now)

    def _wait_for(self, bears: int, following: int) -> Answer | None:
        rules = self._rules
        patience = Patience(rules.longest_s, _LONGEST_LOOK_S, self._wall)
        since, worked = 0.0, self._wire.worked()  # since: when the clock was last moved, or the node last seen at work
        while True:
            heard = [answer for answer in self._wire.hear(rules.every_s) if self._take(answer, bears)]
            if heard:
                return heard[0]
            left = patience.look()
            if self.tick(following):
                worked, since = self._wire.worked(), patience.waited
            elif self._may_be_silent and (lull := patience.waited - since) >= rules.quiet_s:
                work = self._wire.worked()
                if work - worked <= _QUIET_SHARE * lull:
                    return None
                worked, since = work, patience.waited
            if not left:
                return None

    def _take(self, answer: Answer, awaited: int) -> bool:
        """Whether it is the one that is waited for."""
        if answer.stamp > self._newest + SAME:
            ahead = (answer.stamp - self._newest) / NANOSECONDS
            raise InvalidOutputError(f"a pose stamped {ahead:g} s after the newest frame that the node was given")
        open_ones = reversed(self._open.items())
        frame = next((begin for begin, end in open_ones if begin - SAME <= answer.stamp <= end + SAME), None)
        if frame is None:
            self.counts.unmatched += 1
            self._strayed = answer.stamp - self._newest
            return False
        del self._open[frame]
        if frame != awaited:
            self.counts.late += 1
            return False
        self.counts.answered += 1
        return True

    @property
    def _may_be_silent(self) -> bool:
        """Whether the frame that was said last need not be answered."""
        begun = self._newest if self._first is None else self._first
        return self._rules.answers is Answers.SPARSE or self._newest < begun + self._rules.silent_start

    def _missed(self) -> None:
        self.counts.missing += 1
        if self._may_be_silent:
            return
        self._in_a_row += 1
        if self._in_a_row >= self._rules.in_a_row:
            stray = ""
            if self._strayed is not None:
                off = self._strayed / NANOSECONDS
                stray = f"; the last answer of no frame was stamped {off:+.6f} s from the frame that was newest then"
            raise StalledError(f"the node has not answered {self._in_a_row} frames in a row ({self.counts}{stray})")
