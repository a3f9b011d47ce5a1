"""Rounds and modes, as the paper drives them (Sec. III; protocol 1.7, 7.3).

without-map: every round is a trial of its own: the robot is put back, odometry, costmaps and SLAM start from nothing.
with-map: one SLAM lifetime; a priming round, then the rounds that count, without any reset: from the last goal the
robot drives straight to the first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from taskslam.benchmark.platform import Platform
from taskslam.benchmark.traveller import Effort, Poses, Traveller
from taskslam.geometry import SE2
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.outcomes import Outcome
from taskslam.record.events import Arrival, GoalFailed, GoalSkipped, GoalStarted, RoundEnded, RoundStarted, RunEnded
from taskslam.record.run_directory import RunWriter
from taskslam.slam.guest.failure import MethodFailedError
from taskslam.task import OnFailure, Task


@dataclass
class Tour:
    """One run's cast: everything that a round needs, and the counters that it leaves.

    new_traveller: a fresh one for every lifetime.
    """

    task: Task
    platform: Platform
    new_traveller: Callable[[], Traveller]
    record: RunWriter
    observer: Observer
    last_failure: str | None = None
    compute_s: float = 0.0
    method_peak_bytes: int = 0
    method_cpu_s: float = 0.0
    stop_failures: list[str] = field(default_factory=list)
    frames: int = 0
    dropped_frames: int = 0

    def __post_init__(self) -> None:
        """Rounds that ended before an interruption count."""
        done = self.record.resumed
        self.last_failure, self.compute_s, self.method_peak_bytes = done.failure, done.compute_s, done.peak_bytes
        self.frames, self.dropped_frames = done.frames, done.dropped_frames
        self.method_cpu_s, self.stop_failures = done.cpu_s, [*done.stop_failures]


def drive_tour(tour: Tour, mode: Mode) -> bool:
    """Drive all rounds; whether every goal of every round was reached."""
    driver = _without_map if mode is Mode.WITHOUT_MAP else _with_map
    complete = driver(tour)
    tour.record.event(RunEnded(tour.platform.now, complete))
    return complete


def _without_map(tour: Tour) -> bool:
    done, rounds = tour.record.resumed, tour.task.protocol.rounds
    complete = done.complete
    for number in range(done.rounds, rounds):
        tour.observer.round_begins(number, rounds, priming=False)
        tour.record.event(RoundStarted(tour.platform.now, number, priming=False))
        complete = _guarded(tour, [(number, False)]) and complete
    return complete


def _with_map(tour: Tour) -> bool:
    rounds = tour.task.protocol.rounds
    numbers = [(number, number == 0) for number in range(rounds + 1)]
    tour.observer.round_begins(0, rounds + 1, priming=True)
    tour.record.event(RoundStarted(tour.platform.now, 0, priming=True))
    return _guarded(tour, numbers)


def _guarded(tour: Tour, numbers: list[tuple[int, bool]]) -> bool:
    """One SLAM lifetime over these rounds; a method that fails ends it, and its failure is recorded."""
    life = _Lifetime(tour, tour.new_traveller(), *numbers[0])
    try:
        return life.live(numbers)
    except MethodFailedError as failure:
        life.end_by(failure)
        return False
    except BaseException:
        tour.platform.halt()  # first of all: a method may take seconds to end
        raise
    finally:
        life.traveller.stop()
        effort = life.traveller.effort()
        tour.compute_s += effort.compute_s
        tour.method_peak_bytes = max(tour.method_peak_bytes, effort.peak_memory)
        tour.method_cpu_s += effort.cpu_s
        if effort.stop_failure:
            tour.stop_failures.append(f"round {life.round}: {effort.stop_failure}")
            tour.observer.notice(tour.stop_failures[-1])


class _Lifetime:
    """One start of SLAM until its end: one round without map, all rounds with map."""

    def __init__(self, tour: Tour, traveller: Traveller, first_round: int, primed: bool) -> None:
        self.tour = tour
        self.traveller = traveller
        self.round = first_round
        self.primed = primed
        self.goal: tuple[int, SE2] = (0, tour.task.goals[0])
        self.counted = Effort()

    def live(self, numbers: list[tuple[int, bool]]) -> bool:
        """Start, then drive the rounds one after the other; whether every goal was reached."""
        tour, traveller = self.tour, self.traveller
        traveller.begin_round(self.round)
        traveller.start(tour.task.protocol.still_start)
        complete = True
        for number, priming in numbers:
            if number != numbers[0][0]:
                tour.observer.round_begins(number, len(numbers), priming)
                tour.record.event(RoundStarted(tour.platform.now, number, priming))
            self.round = number
            traveller.begin_round(number)
            outcome = self._round()
            complete = complete and outcome is Outcome.REACHED
            aborted = outcome is not Outcome.REACHED and tour.task.protocol.on_failure is OnFailure.ABORT
            if not aborted and number == numbers[-1][0] and self._is_followed():
                self._return()
            if aborted or number == numbers[-1][0]:
                traveller.stop()  # how it fails at that is told in this round
            self._end_round(outcome)
            if aborted:
                break
        return complete

    def _is_followed(self) -> bool:
        """Whether another lifetime begins at the start, to which the robot shall drive by itself."""
        return self.tour.platform.returns and self.round + 1 < self.tour.task.protocol.rounds

    def _return(self) -> None:
        """Drive to the start, while SLAM of this round still lives; where that fails, somebody must bring the robot."""
        start = self.tour.task.start
        assert start is not None  # only a replay has none
        journey = self.traveller.go_to(start.pose)
        if journey.outcome is Outcome.REACHED:
            self.tour.platform.returned()
        else:
            self.tour.observer.notice(f"the robot has not come to the start: {journey.outcome}: {journey.detail}")

    def _round(self) -> Outcome:
        tour, protocol = self.tour, self.tour.task.protocol
        goals = tour.task.goals
        outcome = Outcome.REACHED
        for index, target in enumerate(goals):
            self.goal = (index, target)
            tour.observer.heading_for(index, len(goals))
            tour.record.event(GoalStarted(tour.platform.now, self.round, index, target))
            journey = self.traveller.go_to(target)
            if journey.outcome is Outcome.REACHED:
                self.traveller.wait(protocol.pause)
                at = self.traveller.poses()
                tour.record.event(
                    Arrival(tour.platform.now, self.round, index, target, at.truth, at.estimate, at.odometry)
                )
                continue
            outcome = journey.outcome
            self._failed(outcome, journey.detail, self.traveller.poses())
            if protocol.on_failure is OnFailure.ABORT:
                for never_tried in range(index + 1, len(goals)):
                    tour.record.event(GoalSkipped(tour.platform.now, self.round, never_tried))
                break
        return outcome

    def end_by(self, failure: MethodFailedError) -> None:
        """Record that the method itself ended this lifetime."""
        self._failed(failure.outcome, failure.detail, self.traveller.poses())
        self.traveller.stop()
        self._end_round(failure.outcome)

    def _failed(self, outcome: Outcome, detail: str, at: Poses) -> None:
        tour, (index, target) = self.tour, self.goal
        tour.platform.halt()
        failed = GoalFailed(
            tour.platform.now, self.round, index, target, outcome, detail, at.truth, at.estimate, at.odometry
        )
        tour.record.event(failed)
        tour.last_failure = failed.words(self.primed)
        tour.observer.notice(tour.last_failure)

    def _end_round(self, outcome: Outcome) -> None:
        effort = self.traveller.effort()
        before, self.counted = self.counted, effort
        frames, dropped = effort.frames - before.frames, effort.dropped_frames - before.dropped_frames
        self.tour.frames += frames
        self.tour.dropped_frames += dropped
        self.tour.record.tally(
            self.round,
            effort.compute_s - before.compute_s,
            effort.peak_memory,
            effort.cpu_s - before.cpu_s,
            effort.stop_failure,
        )
        self.tour.record.event(RoundEnded(self.tour.platform.now, self.round, outcome, frames, dropped))
