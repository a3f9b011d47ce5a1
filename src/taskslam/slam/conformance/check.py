"""The conformance suite: what anyone may expect of a SLAM method here, tried through the same host that runs it.

    for result in check_method("my_package.my_module:MyMethod", {}, load_robot("turtlebot2").rig):
        print(result)

It runs on the drive of `drive.py`, in simulated time, so nothing fails for being slow; a method is only given up as
hung after `Limits.frame_timeout_s`. What a frame took is told for the card, and judged by nobody.

| check | holds when |
|---|---|
| needs_declared | the card is valid and asks only for sensors that the robot has |
| poses | a first drive of one minute ends with poses, all finite, rigid and in stamp order |
| tracks_the_drive | those poses stay within half a metre of the truth: frames and units are right |
| latency | tells the processor time of a frame, beside what the card says (skipped if it says nothing) |
| silence | nothing fed, nothing said; and no pose is said twice, also while no scan comes |
| memory | peak memory no longer grows by much in the second half of a long drive over known ground |
| restart | a second start begins at the origin again |
| determinism | a second run of the first drive gives the same bytes (only if the card says deterministic) |
| map_round_trip | a saved map can be loaded by a new start, which then tracks (only if the card says can_save_map) |
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TypeAlias

import numpy as np

from taskslam.errors import InputError, MethodUnavailableError, UnknownMethodError
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, Sensor
from taskslam.processes.guest import Limits
from taskslam.processes.scratch import Scratch
from taskslam.robot import SensorRig
from taskslam.sensors import fitted, sensor_kind
from taskslam.slam.base import PoseEstimate, Status
from taskslam.slam.cards import card_of
from taskslam.slam.conformance.drive import BY_FORMULA, ConformanceDrive, Look
from taskslam.slam.guest.failure import MethodFailedError
from taskslam.slam.guest.host import MethodHost

MakeLooks: TypeAlias = Callable[[SensorRig, Collection[Sensor]], Mapping[Sensor, Look]]

_FIRST_DRIVE_S = 60.0
_SILENCE_S = 2.0
_MAP_DRIVE_S = 15.0
_LARGEST_ERROR_M = 0.5
_ORIGIN_M, _ORIGIN_RAD = 0.05, 0.05
_MEMORY_GROWTH_MB = 64.0
_CONTROL_PERIOD = NANOSECONDS // 10


class Verdict(StrEnum):
    """How one check ended."""

    PASSED = "passed"
    FAILED = "failed"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class CheckResult:
    """One check: its name, how it ended, and one sentence of detail with the measured figure."""

    name: str
    verdict: Verdict
    detail: str


class _FailedError(Exception):
    """The check does not hold."""


class _SkippedError(Exception):
    """The check does not apply, or cannot be tried any more."""


def check_method(
    method: str,
    options: Mapping[str, object],
    rig: SensorRig,
    minutes: float = 10.0,
    limits: Limits | None = None,
    on_result: Callable[[CheckResult], None] = lambda _: None,
    make_looks: MakeLooks | None = None,
) -> list[CheckResult]:
    """Try a method; every check is in the result once, in the order of the module's table.

    method: a registered name or `package.module:Class`. minutes: simulated length of the memory check, at least 1.
    on_result: told of each result as soon as it is known. make_looks: makes what those sensors of a rig say on the
    drive that no formula knows, such as cameras (`benchmark.conformance_eyes`), called only for a method that needs
    them; without it such a method is skipped.

    Raises:
        UnknownMethodError, MethodUnavailableError: there is nothing to check.
        HostFailedError, DiskFullError: the checks cannot be run here.
    """
    if not minutes >= 1:
        raise InputError(f"the memory check runs for {minutes:g} simulated minutes; expected at least 1")
    with Scratch("check") as scratch, ExitStack() as stack:
        suite = _Suite(method, options, rig, minutes, limits or Limits(), scratch.folder, stack, make_looks)
        results = []
        for name, check in suite.checks().items():
            results.append(_try(name, check))
            on_result(results[-1])
        return results


def _try(name: str, check: Callable[[], str]) -> CheckResult:
    try:
        return CheckResult(name, Verdict.PASSED, check())
    except _SkippedError as skipped:
        return CheckResult(name, Verdict.SKIPPED, str(skipped))
    except (_FailedError, MethodFailedError) as failure:
        return CheckResult(name, Verdict.FAILED, str(failure))
    except (UnknownMethodError, MethodUnavailableError):
        raise
    except InputError as error:
        return CheckResult(name, Verdict.FAILED, str(error))


class _Suite:
    """The checks in order; what one learns, the next may use."""

    def __init__(
        self,
        method: str,
        options: Mapping[str, object],
        rig: SensorRig,
        minutes: float,
        limits: Limits,
        folder: Path,
        stack: ExitStack,
        make_looks: MakeLooks | None,
    ) -> None:
        self._method, self._options, self._rig, self._limits = method, options, rig, limits
        self._minutes, self._folder, self._stack = minutes, folder, stack
        self._make_looks = make_looks
        self._host: MethodHost | None = None
        self._drive = ConformanceDrive(rig)
        self._first: list[PoseEstimate] | None = None
        self._clock_s = 0.0

    def checks(self) -> dict[str, Callable[[], str]]:
        """Name and function of each check."""
        return {
            "needs_declared": self._needs_declared,
            "poses": self._poses,
            "tracks_the_drive": self._tracks_the_drive,
            "latency": self._latency,
            "silence": self._silence,
            "memory": self._memory,
            "restart": self._restart,
            "determinism": self._determinism,
            "map_round_trip": self._map_round_trip,
        }

    def _needs_declared(self) -> str:
        card = self._started().card
        still = max(2.0, card.needs_still_start)
        hears = card.hears(fitted(self._rig))
        seen = frozenset(hears) - BY_FORMULA
        looks = self._make_looks(self._rig, seen) if seen and self._make_looks else None
        sensors = {*hears, Sensor.WHEEL_ODOMETRY}
        self._drive = ConformanceDrive(self._rig, still, sensors=sensors, looks=looks)
        return f"{card.name} {card.version} ({card.kind}) asks for {', '.join(hears)}"

    def _poses(self) -> str:
        estimates = self._run(_FIRST_DRIVE_S)
        tracking = [e for e in estimates if e.status is Status.TRACKING]
        if not tracking:
            raise _FailedError(f"{len(estimates)} poses in {_FIRST_DRIVE_S:g} s, none of them with status tracking")
        self._first = estimates
        lost = sum(e.status is Status.LOST for e in estimates)
        return f"{len(estimates)} poses in {_FIRST_DRIVE_S:g} s, {lost} of them lost, all finite, rigid and in order"

    def _tracks_the_drive(self) -> str:
        return self._within_tolerance(self._first_drive())

    def _latency(self) -> str:
        host, _ = self._alive(), self._first_drive()
        took = np.array([compute for _, compute, _ in host.answered()]) / NANOSECONDS * 1e3
        if not len(took):
            raise _SkippedError("it takes no frames: no scan, cloud or picture")
        figure = f"a frame takes {took.mean():.1f} ms of processor time here, {np.percentile(took, 95):.1f} at p95"
        if host.card.latency is None:
            fitting = f"{math.ceil(np.percentile(took, 95)) / 1e3:g}"
            raise _SkippedError(f"{figure}; its card names no latency: latency={fitting} would hold for 19 of 20")
        return f"{figure}; its card says {host.card.latency * 1e3:g} ms"

    def _silence(self) -> str:
        host, first = self._alive(), self._first_drive()
        self._clock_s += 0.5
        first = first + host.collect(self._now)  # the answers that were still due
        self._clock_s += 0.5
        if host.collect(self._now):
            raise _FailedError("it gave a pose though nothing was fed")
        takes_frames = any(sensor_kind(sensor).is_frame for sensor in host.card.sensors)
        first = first + self._run(_SILENCE_S, scans=not takes_frames)
        for before, after in itertools.pairwise(first):
            if after.stamp <= before.stamp:
                raise _FailedError(f"two poses carry the stamp {after.stamp / NANOSECONDS:.3f} s: nothing was new")
        return f"no pose without input, and {len(first)} stamps that all differ"

    def _memory(self) -> str:
        host = self._alive()
        half = self._minutes * 30.0
        self._run(half)
        before = host.peak_memory / 1e6
        self._run(half)
        after = host.peak_memory / 1e6
        figure = f"peak {before:.0f} MB after {self._minutes / 2:g} simulated minutes, {after:.0f} MB after twice that"
        if after - before > _MEMORY_GROWTH_MB:
            raise _FailedError(f"{figure}; expected less than {_MEMORY_GROWTH_MB:g} MB of growth over known ground")
        return figure

    def _restart(self) -> str:
        first = self._first_drive()
        self._started()
        self._again = self._run(_FIRST_DRIVE_S)
        for which, estimates in (("first", first), ("second", self._again)):
            if not estimates:
                raise _FailedError("the second start gave no pose at all")
            pose, truth = SE2.from_matrix(estimates[0].T_start_base), self._drive.pose(estimates[0].stamp)
            apart = truth.inverse() @ pose
            if math.hypot(apart.x, apart.y) > _ORIGIN_M or abs(apart.theta) > _ORIGIN_RAD:
                where = f"({pose.x:.3f} m, {pose.y:.3f} m, {pose.theta:.3f} rad)"
                raise _FailedError(f"the {which} start begins at {where}; expected the origin")
        return "the second start begins at the origin, as the first did"

    def _determinism(self) -> str:
        host, first = self._alive(), self._first_drive()
        if not host.card.deterministic:
            raise _SkippedError("its card does not promise it")
        for one, two in zip(first, self._again, strict=False):
            if one.stamp != two.stamp or one.T_start_base.tobytes() != two.T_start_base.tobytes():
                raise _FailedError(
                    f"two runs of the same drive differ from {one.stamp / NANOSECONDS:.3f} s on, though its card says "
                    f"deterministic"
                )
        if len(first) != len(self._again):
            raise _FailedError(f"two runs of the same drive gave {len(first)} and {len(self._again)} poses")
        return f"two runs gave the same bytes in all {len(first)} poses"

    def _map_round_trip(self) -> str:
        host = self._alive()
        if not host.card.can_save_map:
            raise _SkippedError("it keeps no map")
        path = self._folder / "map"
        host.save_map(path)
        self._started().load_map(path)
        return f"{path.stat().st_size / 1e3:.0f} kB; after loading: " + self._within_tolerance(self._run(_MAP_DRIVE_S))

    @property
    def _now(self) -> int:
        return round(self._clock_s * NANOSECONDS)

    def _started(self) -> MethodHost:
        """Stop the method if it runs, and start it at the beginning of the drive."""
        if self._host is not None:
            self._host.stop()
        self._host = None
        log, card = self._folder / "method.log", card_of(self._method)
        host = MethodHost(self._method, self._options, self._rig, log, limits=self._limits, described=card)
        self._stack.callback(host.stop)
        host.start()
        self._host, self._clock_s = host, 0.0
        return host

    def _alive(self) -> MethodHost:
        if self._host is None:
            raise _SkippedError("the method failed before")
        if (seen := frozenset(self._host.card.sensors) - BY_FORMULA) and self._make_looks is None:
            raise _SkippedError(f"it needs {', '.join(sorted(seen))}, and nobody rendered any")
        return self._host

    def _first_drive(self) -> list[PoseEstimate]:
        if self._first is None:
            self._alive()
            raise _SkippedError("the first drive failed")
        return self._first

    def _run(self, seconds: float, scans: bool = True) -> list[PoseEstimate]:
        """Drive on for so many simulated seconds; returns the poses that were delivered meanwhile."""
        host, estimates = self._alive(), []
        begin = collected = self._now
        self._clock_s += seconds
        try:
            for measurement in self._drive.measurements(begin, self._now, scans):
                if measurement.stamp >= collected + _CONTROL_PERIOD:
                    collected = measurement.stamp
                    estimates += host.collect(collected)
                host.feed(measurement)
            estimates += host.collect(self._now)
        except MethodFailedError:
            self._host = None
            raise
        return estimates

    def _within_tolerance(self, estimates: list[PoseEstimate]) -> str:
        tracking = [e for e in estimates if e.status is Status.TRACKING]
        if not tracking:
            raise _FailedError("no pose with status tracking")
        truth = [self._drive.pose(e.stamp) for e in tracking]
        errors = np.array(
            [t.distance_to(SE2.from_matrix(e.T_start_base)) for t, e in zip(truth, tracking, strict=True)]
        )
        figure = f"at most {errors.max():.3f} m from the truth, {errors.mean():.3f} m on average"
        if errors.max() > _LARGEST_ERROR_M:
            raise _FailedError(f"{figure}; expected at most {_LARGEST_ERROR_M:g} m")
        return figure
