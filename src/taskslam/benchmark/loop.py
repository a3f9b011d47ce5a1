"""The closed loop: sense, localise, navigate, drive, in simulated time.

The wall around the truth stands here: the navigator and the method are given measurements and estimates, never the
platform; the true pose goes from the platform to the record, and to a method only if its card says `reference`.
"""

from __future__ import annotations

from taskslam.benchmark.platform import Platform
from taskslam.benchmark.plausibility import Plausibility
from taskslam.benchmark.traveller import Effort, Journey, Poses
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, LaserScan, Measurement, TruePose, WheelOdometry
from taskslam.navigation.localization import Correction, Localization
from taskslam.navigation.navigator import Navigator, Step
from taskslam.observer import Observer
from taskslam.outcomes import Outcome
from taskslam.record.events import MethodNotice
from taskslam.record.newest import Newest, newest_state
from taskslam.record.run_directory import RunWriter
from taskslam.slam import Kind, PoseEstimate, Status
from taskslam.slam.guest.host import MethodHost

TICK = NANOSECONDS // 20  # the velocity smoother's 20 Hz: the loop's beat
_SILENT = 2 * NANOSECONDS  # without an estimate for so long, a failed goal is the method's: it was lost


class ClosedLoop:
    """One SLAM method steering one platform, from the start pose on: our traveller."""

    def __init__(
        self,
        platform: Platform,
        method: MethodHost,
        navigator: Navigator,
        record: RunWriter,
        start: SE2,
        observer: Observer,
    ) -> None:
        self.platform = platform
        self.method = method
        self.navigator = navigator
        self.record = record
        self.origin = start
        self.observer = observer
        self.round = 0
        self._forget()

    def start(self, still_s: float) -> None:
        """Put the robot down, start the method, and stand still as long as both need."""
        if said := self.platform.place(self.origin):
            self._notice(said)
        self.navigator.reset()
        self.observer.stage("starting the method")
        self.method.start()
        self._forget()
        self.wait(max(still_s, self.method.card.needs_still_start))

    def begin_round(self, number: int) -> None:
        """What is recorded from now on belongs to this round."""
        self.round = number

    def go_to(self, goal: SE2) -> Journey:
        """Drive to `goal` (in `map`) until navigation says that it is reached, or why not; then the robot stands."""
        self.navigator.start_goal(goal, self.platform.now)
        while True:
            step = self.tick()
            if step.outcome is Outcome.REACHED:
                return Journey(step.outcome, step.detail)
            if step.outcome is not None:
                self.platform.halt()
                self.navigator.halt()
                return self._blame(step.outcome, step.detail)

    def wait(self, seconds: float) -> None:
        """Stand still for so many simulated seconds; sensors and SLAM go on."""
        until = self.platform.now + round(seconds * NANOSECONDS)
        while self.platform.now < until:
            self.tick()

    def poses(self) -> Poses:
        """True, SLAM-based and odometry pose of this instant, in `map`."""
        return Poses(self.platform.true_pose(), self.localization.T_map_base(), self.origin @ self.odometry.T_odom_base)

    def effort(self) -> Effort:
        """Frames and compute time of the method so far."""
        method = self.method
        return Effort(
            method.frames,
            method.dropped_frames,
            method.compute_s,
            method.peak_memory,
            method.cpu_s,
            method.stop_failure,
        )

    def stop(self) -> None:
        """End the method. How it failed at that is a notice: its poses are in."""
        already = self.method.stop_failure
        self.method.stop()
        if self.method.stop_failure != already:
            self._notice(self.method.stop_failure)

    def tick(self) -> Step:
        """One beat: measurements in, estimates in, one decision out."""
        until = self.platform.now + TICK
        for measurement in self.platform.advance(until):
            self._sense(measurement)
        until = max(until, self.platform.now)  # a real robot's time waits for nobody
        for estimate in self.method.collect(until):
            self._localise(estimate)
        self.record.frames(self.round, self.method.answered())
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
        self.record.show(self._newest)
        return step

    def _newest(self) -> Newest:
        at = self.poses()
        return newest_state(self.platform.now, self.round, at.truth, at.estimate, self.navigator.scan_in_map())

    def _forget(self) -> None:
        self.localization = Localization(self.origin)
        self.plausibility = Plausibility()
        self.odometry = WheelOdometry(self.platform.now, SE2(), 0.0, 0.0)
        self.last_estimate = self.platform.now
        self.status = Status.STARTING

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

    @property
    def is_reference(self) -> bool:
        """Whether the method is one that is told the truth."""
        return self.method.card.kind is Kind.REFERENCE

    def _trace(self, odometry: WheelOdometry) -> None:
        truth = self.platform.true_pose()
        self.record.pose("odometry", self.round, odometry.stamp, self.origin @ odometry.T_odom_base)
        if truth is None:
            return
        self.record.pose("truth", self.round, odometry.stamp, truth)
        if self.is_reference:
            self.method.feed(TruePose(odometry.stamp, self.origin.inverse() @ truth))

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
        self.record.pose("estimate", self.round, estimate.stamp, self.origin @ T_start_base)

    def _notice(self, text: str) -> None:
        self.record.event(MethodNotice(self.platform.now, self.round, text))

    def _blame(self, outcome: Outcome, detail: str) -> Journey:
        """A goal that fails while the method is lost or silent is the method's failure (design D6)."""
        silent = self.platform.now - self.last_estimate
        if self.status is not Status.LOST and silent <= _SILENT:
            return Journey(outcome, detail)
        why = "lost" if self.status is Status.LOST else "silent"
        return Journey(Outcome.LOST, f"the method was {why} for {silent / NANOSECONDS:.1f} s; then {outcome}: {detail}")
