"""When a method's answer arrives, in simulated time, and which frames it never sees (design D3).

`LatencyModel` says how long a frame takes. `Schedule` is the queue in front of the method: a pure function of stamps
and latencies, so that a slow machine drops exactly the frames that a fast one does.

While a method is busy, that is from taking a frame until delivering its estimate, new frames of each sensor queue up to
`card.queue`; the newest win and the others are counted as dropped. Odometry and IMU are never dropped and take no time
of their own; a method that takes frames gives its poses with them. The method sees everything in stamp order, so what
is newer than a queued frame waits behind it.
"""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass
from enum import StrEnum

from taskslam.errors import InputError
from taskslam.measurements import NANOSECONDS, Measurement, Sensor
from taskslam.sensors import sensor_kind

NEVER = 1 << 62


class LatencyMode(StrEnum):
    """Where the latency of a frame comes from: the method's card, the child's compute time, or nowhere."""

    FIXED = "fixed"
    MEASURED = "measured"
    ZERO = "zero"


@dataclass(frozen=True, slots=True)
class LatencyModel:
    """How long a method takes over a frame. cpu_scale: robot's compute time per second of this machine's CPU time."""

    mode: LatencyMode = LatencyMode.FIXED
    cpu_scale: float = 1.0

    def __post_init__(self) -> None:
        if not 0 < self.cpu_scale < 1e6:
            raise InputError(f"cpu_scale is {self.cpu_scale}; expected a positive number")

    @property
    def words(self) -> str:
        """As run.json says it: fixed, zero, or `measured x 4`."""
        return f"measured x {self.cpu_scale:g}" if self.mode is LatencyMode.MEASURED else self.mode.value

    @classmethod
    def of(cls, words: str) -> LatencyModel:
        """The model of such words. Raises InputError."""
        found = re.fullmatch(r"\s*(fixed|zero|measured)(?:\s*x\s*(\d+(?:\.\d+)?))?\s*", words)
        if found is None or (found[2] and found[1] != LatencyMode.MEASURED):
            raise InputError(f"latency '{words}': expected fixed, zero, measured, or measured x 4 (times slower)")
        return cls(LatencyMode(found[1]), float(found[2] or 1.0))

    def before(self, card_latency: float | None) -> int | None:
        """Latency in ns of any frame, or None while only the method's own compute time can tell."""
        if self.mode is LatencyMode.MEASURED:
            return None
        return round((card_latency or 0.0) * NANOSECONDS) if self.mode is LatencyMode.FIXED else 0

    def after(self, compute: int) -> int:
        """Latency in ns in `measured` mode of a frame that took `compute` ns in the child.

        CPU time; for a method whose threads share the work, the wall time where that is shorter.
        """
        return round(compute * self.cpu_scale)


@dataclass(slots=True)
class HandOver:
    """A measurement that the method gets. taken: ns, the simulated instant at which it takes it.

    due: ns, the simulated instant at which its estimate is delivered; None until the compute time is known, and `NEVER`
    for what a method takes between frames: an estimate caused by it comes with the next frame's.
    """

    number: int
    measurement: Measurement
    taken: int
    due: int | None


class Schedule:
    """Decides what is handed to the method, when, and when the answer is due.

    latency: ns of every frame, or None if `settle` will tell it after each frame. occupying: the sensors whose
    measurements keep the method busy: the frame sensors on its card; for a method without any, nothing occupies it and
    each measurement is answered `latency` after its stamp.
    """

    def __init__(self, sensors: tuple[Sensor, ...], queue: int, latency: int | None) -> None:
        self._occupying = frozenset(sensor for sensor in sensors if sensor_kind(sensor).is_frame)
        self._queue = max(1, queue)
        self._latency = latency
        self._waiting: deque[Measurement] = deque()
        self._busy_until: int | None = 0
        self._last_due = 0
        self._newest = -1
        self._numbers = 0
        self.frames = 0
        self.dropped = 0

    @property
    def unsettled(self) -> bool:
        """Whether the end of the frame in work is not known yet: `settle` must be called before anything else."""
        return self._busy_until is None

    def occupies(self, measurement: Measurement) -> bool:
        """Whether the method is busy for a while with a measurement of this kind."""
        return measurement.sensor in self._occupying

    def offer(self, measurement: Measurement) -> list[HandOver]:
        """A new measurement, in stamp order; returns what the method gets now.

        Raises:
            ValueError: older than what was offered before, or than the instant up to which `advance` went.
        """
        if measurement.stamp < self._newest:
            raise ValueError(f"measurement at {measurement.stamp} ns after {self._newest} ns; expected stamp order")
        handed = self.advance(measurement.stamp)
        occupies = self.occupies(measurement)
        self.frames += occupies
        if self._waiting or (occupies and self._is_busy(measurement.stamp)):
            self._waiting.append(measurement)
            if occupies:
                self._drop_oldest(measurement.sensor)
                handed += self._release_unblocked(measurement.stamp)
        else:
            handed.append(self._take(measurement, measurement.stamp))
        return handed

    def advance(self, until: int) -> list[HandOver]:
        """Let simulated time pass to `until` (ns); returns the queued frames that the method takes on the way."""
        self._newest = max(self._newest, until)
        handed: list[HandOver] = []
        while self._waiting and self._busy_until is not None and self._busy_until <= until:
            taken = self._busy_until
            handed.append(self._take(self._waiting.popleft(), taken))
            handed += self._release_unblocked(taken)
        return handed

    def settle(self, done: HandOver, latency: int) -> int:
        """`measured` mode: what the method has done took `latency` ns; returns when it is due."""
        done.due = self._last_due = max(done.taken + latency, self._last_due)
        if self.occupies(done.measurement):
            self._busy_until = done.due
        return done.due

    def _is_busy(self, now: int) -> bool:
        return self._busy_until is None or self._busy_until > now

    def _take(self, measurement: Measurement, taken: int) -> HandOver:
        self._numbers += 1
        occupies = self.occupies(measurement)
        due: int | None
        if self._occupying and not occupies:
            due = NEVER
        elif self._latency is None:
            due = None
        else:
            due = self._last_due = max(taken + self._latency, self._last_due)
        if occupies:
            self._busy_until = due
        return HandOver(self._numbers, measurement, taken, due)

    def _drop_oldest(self, sensor: Sensor) -> None:
        queued = [i for i, waiting in enumerate(self._waiting) if waiting.sensor == sensor]
        if len(queued) > self._queue:
            del self._waiting[queued[0]]
            self.dropped += 1

    def _release_unblocked(self, now: int) -> list[HandOver]:
        handed = []
        while self._waiting and not self.occupies(self._waiting[0]):
            handed.append(self._take(self._waiting.popleft(), now))
        return handed
