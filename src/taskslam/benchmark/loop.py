"""The closed loop: sense, localise, navigate, drive, in simulated time.

The wall around the truth stands here: the navigator and the method are given measurements and estimates, never the
platform; the true pose goes from the platform to the record, and to a method only if its card says `reference`.
"""

from __future__ import annotations

from dataclasses import dataclass

from taskslam.benchmark.platform import Platform
from taskslam.benchmark.plausibility import Plausibility
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, LaserScan, Measurement, TruePose, WheelOdometry
from taskslam.navigation.localization import Correction, Localization
from taskslam.navigation.navigator import Navigator, Step
from taskslam.observer import Observer
from taskslam.outcomes import Outcome
from taskslam.record.events import MethodNotice
from taskslam.record.run_directory import RunWriter
from taskslam.slam import Kind, PoseEstimate, Status
from taskslam.slam.guest.host import MethodHost

TICK = NANOSECONDS // 20  # the velocity smoother's 20 Hz: the loop's beat
_SILENT = 2 * NANOSECONDS  # without an estimate for so long, a failed goal is the method's: it was lost


@dataclass
class Poses:
    """Where the robot is, thinks it is, and has counted itself to be; all in `map`."""

    truth: SE2 | None
    estimate: SE2
    odometry: SE2


class ClosedLoop:
    """One SLAM method steering one platform, from the start pose on. A new one for every reset."""

    def __init__(
        self,
        platform: Platform,
        method: MethodHost,
        navigator: Navigator,
        record: RunWriter,
        start: SE2,
        round_number: int,
        observer: Observer,
    ) -> None:
        self.platform = platform
        self.method = method
        self.navigator = navigator
        self.record = record
        self.start = start
        self.round = round_number
        self.observer = observer
        self.localization = Localization(start)
        self.plausibility = Plausibility()
        self.odometry = WheelOdometry(platform.now, SE2(), 0.0, 0.0)
        self.last_estimate = platform.now
        self.status = Status.STARTING
        self.is_reference = method.card.kind is Kind.REFERENCE

    def go_to(self, goal: SE2) -> Step:
        """Drive to `goal` (in `map`) until navigation says that it is reached, or why not."""
        self.navigator.start_goal(goal, self.platform.now)
        while True:
            step = self.tick()
            if step.outcome is not None:
                return self._blame(step)

    def wait(self, seconds: float) -> None:
        """Stand still for so many simulated seconds; sensors and SLAM go on."""
        until = self.platform.now + round(seconds * NANOSECONDS)
        while self.platform.now < until:
            self.tick()

    def tick(self) -> Step:
        """One beat: measurements in, estimates in, one decision out."""
        until = self.platform.now + TICK
        for measurement in self.platform.advance(until):
            self._sense(measurement)
        for estimate in self.method.collect(until):
            self._localise(estimate)
        step = self.navigator.step(
            until,
            self.localization.T_map_odom,
            self.odometry.T_odom_base,
            self.odometry.linear,
            self.odometry.angular,
            self.platform.bumped(),
        )
        self.platform.drive(step.linear, step.angular)
        self.observer.ticked(until)
        return step

    def poses(self) -> Poses:
        """True, SLAM-based and odometry pose of this instant, in `map`."""
        return Poses(self.platform.true_pose(), self.localization.T_map_base(), self.start @ self.odometry.T_odom_base)

    def _sense(self, measurement: Measurement) -> None:
        if isinstance(measurement, WheelOdometry):
            self.odometry = measurement
            self.localization.odometry(measurement.stamp, measurement.T_odom_base)
            self._trace(measurement)
        elif isinstance(measurement, LaserScan):
            T_odom_base = self.localization.T_odom_base_at(measurement.stamp)
            if T_odom_base is not None:
                self.navigator.sense(measurement, self.localization.T_map_odom, T_odom_base)
        self.method.feed(measurement)

    def _trace(self, odometry: WheelOdometry) -> None:
        truth = self.platform.true_pose()
        self.record.pose("odometry", self.round, odometry.stamp, self.start @ odometry.T_odom_base)
        if truth is None:
            return
        self.record.pose("truth", self.round, odometry.stamp, truth)
        if self.is_reference:
            self.method.feed(TruePose(odometry.stamp, self.start.inverse() @ truth))

    def _localise(self, estimate: PoseEstimate) -> None:
        if estimate.status is not self.status:
            self._notice(f"{self.status} -> {estimate.status}")
            self.status = estimate.status
        if estimate.status is not Status.TRACKING:
            return
        T_start_base = SE2.from_matrix(estimate.T_start_base)
        verdict = self.localization.correct(estimate.stamp, T_start_base)
        if verdict is not Correction.APPLIED:
            self._notice(f"estimate of {estimate.stamp} ns refused: {verdict}")
            return
        T_odom_base = self.localization.T_odom_base_at(estimate.stamp) or self.localization.T_odom_base
        if doubt := self.plausibility.doubt(estimate.stamp, self.localization.T_map_odom, T_odom_base):
            self._notice(doubt)
        self.last_estimate = estimate.stamp
        self.record.pose("estimate", self.round, estimate.stamp, self.start @ T_start_base)

    def _notice(self, text: str) -> None:
        self.record.event(MethodNotice(self.platform.now, self.round, text))

    def _blame(self, step: Step) -> Step:
        """A goal that fails while the method is lost or silent is the method's failure (design D6)."""
        if step.outcome is Outcome.REACHED:
            return step
        silent = self.platform.now - self.last_estimate
        if self.status is not Status.LOST and silent <= _SILENT:
            return step
        why = "lost" if self.status is Status.LOST else "silent"
        detail = f"the method was {why} for {silent / NANOSECONDS:.1f} s; then {step.outcome}: {step.detail}"
        return Step(step.linear, step.angular, Outcome.LOST, detail)
