"""A traveller whose navigation and SLAM are somebody else's: goals are sent, and where the robot is its /tf says.

Goals are poses in our `map`, the floor plan's. The map of a SLAM that began without one has its origin where the robot
started; which of the two it is shows at the start, where the robot stands at a pose that both know.
"""

from __future__ import annotations

import time

from taskslam.benchmark.ros_platform import RobotFailedError
from taskslam.benchmark.stack_platform import PoseUnknownError, StackPlatform
from taskslam.benchmark.traveller import Effort, Journey, Poses, Traveller
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, WheelOdometry
from taskslam.navigation.settings import GoalSettings, TebSettings
from taskslam.observer import Observer
from taskslam.outcomes import Outcome
from taskslam.record.events import MethodNotice
from taskslam.record.run_directory import RunWriter
from taskslam.ros.navigation import judged

_TICK = NANOSECONDS // 20
_PATIENCE_S = 30.0  # on the wall's clock, for a stack that is started again between rounds
_NEAR_M, _NEAR_RAD = 1.0, 0.5  # a start pose that is meant
_SPEED = TebSettings().max_vel_x  # m/s: a stack may take as long as our own navigator may


class StackTraveller(Traveller):
    """Somebody's navigation, from the start pose on. cancel_s: so long a goal has to end that was given up."""

    def __init__(
        self,
        platform: StackPlatform,
        record: RunWriter,
        origin: SE2,
        patience: GoalSettings,
        cancel_s: float,
        observer: Observer,
    ) -> None:
        self._platform, self._record, self._origin = platform, record, origin
        self._patience, self._cancel_s, self._observer = patience, cancel_s, observer
        self._T_map_theirs = SE2()
        self._odometry = SE2()
        self._round = 0

    def start(self, still_s: float) -> None:
        """Have the robot put down, and see where its stack believes it to be. Raises RobotFailedError."""
        if said := self._platform.place(self._origin):
            self._notice(said)
        deadline = time.monotonic() + _PATIENCE_S
        self._tick(stand=True)
        while (wrong := self._not_ready()) and time.monotonic() < deadline:
            self._tick(stand=True)
        if wrong:
            raise RobotFailedError(f"{wrong}, {_PATIENCE_S:g} s after the robot was put down")
        self.wait(still_s)

    def begin_round(self, number: int) -> None:
        """What is recorded from now on belongs to this round."""
        self._round = number

    def go_to(self, goal: SE2) -> Journey:
        """Send the goal and wait for its end, or for as long as it may take; then the robot stands."""
        platform, patience = self._platform, self._patience
        theirs = self._T_map_theirs.inverse() @ goal
        away = (self._estimate() or self._origin @ self._odometry).distance_to(goal)
        longest_s = patience.timeout_base + patience.timeout_factor * away / _SPEED
        deadline = platform.now + round(longest_s * NANOSECONDS)
        platform.send(theirs)
        while (end := platform.ended()) is None:
            if platform.now > deadline:
                self._give_up()
                return Journey(Outcome.GOAL_TIMEOUT, f"not reached within {longest_s:.0f} s")
            self._tick()
        platform.halt()
        outcome, detail = judged(end)
        if outcome is Outcome.REACHED and detail:
            self._notice(detail)
        return Journey(outcome, "" if outcome is Outcome.REACHED else detail)

    def wait(self, seconds: float) -> None:
        """Stand still for so many seconds of the robot's time."""
        until = self._platform.now + round(seconds * NANOSECONDS)
        while self._platform.now < until:
            self._tick(stand=True)

    def poses(self) -> Poses:
        """What /tf says of this instant; odometry counts from the start pose."""
        estimate = self._estimate(tell=True)
        return Poses(None, estimate, self._origin @ self._odometry)

    def effort(self) -> Effort:
        """Their SLAM takes what it takes, on their machine."""
        return Effort()

    def stop(self) -> None:
        """Nothing is under way any more; their SLAM lives on."""
        self._platform.halt()

    def _tick(self, stand: bool = False) -> None:
        """One beat. stand: nobody has the robot move, and it is told so."""
        platform = self._platform
        for measurement in platform.advance(platform.now + _TICK):
            if isinstance(measurement, WheelOdometry):
                self._odometry = measurement.T_odom_base
                self._record.pose("odometry", self._round, measurement.stamp, self._origin @ self._odometry)
                if (estimate := self._estimate()) is not None:
                    self._record.pose("estimate", self._round, measurement.stamp, estimate)
        if stand:
            platform.drive(0.0, 0.0)
        if platform.bumped():
            self._notice("the bumper was pressed")
        self._observer.ticked(platform.now)

    def _give_up(self) -> None:
        """Cancel the goal, and wait for its end as long as a stack may need for that."""
        self._platform.halt()
        until = self._platform.now + round(self._cancel_s * NANOSECONDS)
        while self._platform.ended() is None and self._platform.now < until:
            self._tick()
        self._platform.halt()

    def _not_ready(self) -> str:
        """What a goal cannot be sent for, empty once the stack and the pose are there."""
        if not self._platform.offered():
            return "nobody takes goals"
        try:
            theirs = self._platform.pose()
        except PoseUnknownError as error:
            return str(error)
        known = {"the floor plan's": SE2(), "that of the start": self._origin}
        for words, T_map_theirs in known.items():
            off = (T_map_theirs @ theirs).inverse() @ self._origin
            if off.distance_to(SE2()) <= _NEAR_M and abs(off.theta) <= _NEAR_RAD:
                self._T_map_theirs = T_map_theirs
                self._notice(f"the stack's map is {words}: it has the robot at {theirs.in_words()}")
                return ""
        return (
            f"the robot stands at the start, which its stack has at {theirs.in_words()}; expected"
            f" {self._origin.in_words()} (the floor plan's map) or {SE2().in_words()} (a map that begins here): tell"
            " your localisation where the robot is, or start your SLAM anew"
        )

    def _estimate(self, tell: bool = False) -> SE2 | None:
        try:
            return self._T_map_theirs @ self._platform.pose()
        except PoseUnknownError as error:
            if tell:
                self._notice(str(error))
            return None

    def _notice(self, text: str) -> None:
        self._record.event(MethodNotice(self._platform.now, self._round, text))
