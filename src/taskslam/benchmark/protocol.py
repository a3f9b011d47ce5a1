"""Rounds and modes, as the paper drives them (Sec. III; protocol 1.7, 7.3).

without-map: every round is a trial of its own: the robot is put back, odometry, costmaps and SLAM start from nothing.
with-map: one SLAM lifetime; a priming round, then the rounds that count, without any reset: from the last goal the
robot drives straight to the first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from taskslam.benchmark.loop import ClosedLoop, Poses
from taskslam.benchmark.platform import Platform
from taskslam.geometry import SE2
from taskslam.navigation.navigator import Navigator
from taskslam.observer import Observer
from taskslam.outcomes import Outcome
from taskslam.record.events import Arrival, GoalFailed, GoalSkipped, GoalStarted, RoundEnded, RoundStarted, RunEnded
from taskslam.record.run_directory import RunWriter
from taskslam.scenario import Scenario
from taskslam.slam.guest.failure import MethodFailedError
from taskslam.slam.guest.host import MethodHost
from taskslam.task import Mode, OnFailure


@dataclass
class Tour:
    """One run's cast: everything that a round needs, and the counters that it leaves."""

    scenario: Scenario
    platform: Platform
    navigator: Navigator
    new_method: Callable[[], MethodHost]
    record: RunWriter
    observer: Observer
    last_failure: str | None = None
    compute_s: float = 0.0
    method_peak_bytes: int = 0
    frames: int = 0
    dropped_frames: int = 0


def drive_tour(tour: Tour, mode: Mode) -> bool:
    """Drive all rounds; whether every goal of every round was reached."""
    driver = _without_map if mode is Mode.WITHOUT_MAP else _with_map
    complete = driver(tour)
    tour.record.event(RunEnded(tour.platform.now, complete))
    return complete


def _without_map(tour: Tour) -> bool:
    complete = True
    rounds = tour.scenario.protocol.rounds
    for number in range(rounds):
        tour.observer.round_begins(number, rounds, priming=False)
        tour.record.event(RoundStarted(tour.platform.now, number, priming=False))
        complete = _guarded(tour, number, [(number, False)]) and complete
    return complete


def _with_map(tour: Tour) -> bool:
    rounds = tour.scenario.protocol.rounds
    numbers = [(number, number == 0) for number in range(rounds + 1)]
    tour.observer.round_begins(0, rounds + 1, priming=True)
    tour.record.event(RoundStarted(tour.platform.now, 0, priming=True))
    return _guarded(tour, 0, numbers)


def _guarded(tour: Tour, first: int, numbers: list[tuple[int, bool]]) -> bool:
    """One SLAM lifetime over these rounds; a method that fails ends it, and its failure is recorded."""
    state = _Lifetime(tour, tour.new_method(), first)
    try:
        return state.live(numbers)
    except MethodFailedError as failure:
        state.end_by(failure)
        return False
    finally:
        state.method.stop()
        tour.compute_s += state.method.compute_s
        tour.method_peak_bytes = max(tour.method_peak_bytes, state.method.peak_memory)


class _Lifetime:
    """One start of the SLAM method until its end: one round without map, all rounds with map."""

    def __init__(self, tour: Tour, method: MethodHost, first_round: int) -> None:
        self.tour = tour
        self.method = method
        self.round = first_round
        self.loop: ClosedLoop | None = None
        self.goal: tuple[int, SE2] | None = None
        self.counted = (0, 0)

    def live(self, numbers: list[tuple[int, bool]]) -> bool:
        """Reset, start the method, drive the rounds one after the other; whether every goal was reached."""
        tour, start = self.tour, self.tour.scenario.start.pose
        tour.platform.reset(start)
        tour.navigator.reset()
        self.method.start()
        self.loop = ClosedLoop(
            tour.platform, self.method, tour.navigator, tour.record, start, numbers[0][0], tour.observer
        )
        self.loop.wait(max(tour.scenario.protocol.still_start, self.method.card.needs_still_start))
        complete = True
        for number, priming in numbers:
            if number != numbers[0][0]:
                tour.observer.round_begins(number, len(numbers), priming)
                tour.record.event(RoundStarted(tour.platform.now, number, priming))
            self.round = self.loop.round = number
            outcome = self._round(self.loop)
            self._end_round(outcome)
            if outcome is not Outcome.REACHED:
                complete = False
                if tour.scenario.protocol.on_failure is OnFailure.ABORT:
                    break
        return complete

    def _round(self, loop: ClosedLoop) -> Outcome:
        protocol = self.tour.scenario.protocol
        goals = self.tour.scenario.sequence.goals
        outcome = Outcome.REACHED
        for index, waypoint in enumerate(goals):
            target = waypoint.pose
            self.goal = (index, target)
            self.tour.observer.heading_for(index, len(goals))
            self.tour.record.event(GoalStarted(self.tour.platform.now, loop.round, index, target))
            step = loop.go_to(target)
            if step.outcome is Outcome.REACHED:
                loop.wait(protocol.pause)
                at = loop.poses()
                self.tour.record.event(
                    Arrival(self.tour.platform.now, loop.round, index, target, at.truth, at.estimate, at.odometry)
                )
                continue
            outcome = step.outcome or Outcome.NO_CONTROL
            self._failed(outcome, step.detail, loop.poses())
            if protocol.on_failure is OnFailure.ABORT:
                for never_tried in range(index + 1, len(goals)):
                    self.tour.record.event(GoalSkipped(self.tour.platform.now, loop.round, never_tried))
                break
        return outcome

    def end_by(self, failure: MethodFailedError) -> None:
        """Record that the method itself ended this lifetime."""
        if self.loop is not None and self.goal is not None:
            self._failed(failure.outcome, failure.detail, self.loop.poses())
        else:
            self.goal = (0, self.tour.scenario.sequence.goals[0].pose)
            start = self.tour.scenario.start.pose
            self._failed(failure.outcome, failure.detail, Poses(self.tour.platform.true_pose(), start, start))
        self._end_round(failure.outcome)

    def _failed(self, outcome: Outcome, detail: str, at: Poses) -> None:
        tour = self.tour
        index, target = self.goal or (0, tour.scenario.start.pose)
        tour.record.event(
            GoalFailed(
                tour.platform.now, self.round, index, target, outcome, detail, at.truth, at.estimate, at.odometry
            )
        )
        tour.last_failure = f"round {self.round}, goal {index}: {outcome}: {detail}"
        tour.observer.notice(tour.last_failure)

    def _end_round(self, outcome: Outcome) -> None:
        frames = self.method.frames - self.counted[0]
        dropped = self.method.dropped_frames - self.counted[1]
        self.counted = (self.method.frames, self.method.dropped_frames)
        self.tour.frames += frames
        self.tour.dropped_frames += dropped
        self.tour.record.event(RoundEnded(self.tour.platform.now, self.round, outcome, frames, dropped))
