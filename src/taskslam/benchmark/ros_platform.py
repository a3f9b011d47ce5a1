"""A robot in a ROS graph as a platform: our navigator on a real robot, or on our own served simulator (docs/ros.md).

It is looked at before it moves (`open`), and stands wherever something is wrong: no fresh command, no fresh odometry,
the stop button, a clock that stands or goes back, nobody who reads our commands. Time is that of the robot's stamps:
/clock where there is one, else this machine's, by which the robot's clock is held.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from datetime import UTC, datetime, timedelta
from typing import Any, Protocol

from taskslam.benchmark.platform import Platform
from taskslam.benchmark.shifting import shifted
from taskslam.benchmark.stage import Stage
from taskslam.datasets.ros_encoding import MAP, RosEncoder
from taskslam.errors import InfrastructureError, InputError
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, Measurement, Sensor, WheelOdometry
from taskslam.observer import Observer
from taskslam.record.manifest import DrivenBy
from taskslam.ros import names
from taskslam.ros.connection import Connection
from taskslam.ros.hearing import Hearing
from taskslam.ros.transport import Heard, SlowReaderError, Transport
from taskslam.stopping import undisturbed

_LOOK_EVERY_S = 0.02
_TICK = NANOSECONDS // 20
_PATIENCE_S = 10.0  # on the wall's clock, for a clock that stands, a robot that is put down
_READY_S = 5.0  # on the wall's clock, for others to find us: longer than a look, but no longer than that
_SETTLED_S = 0.5
_OWED_S = 2.0  # in simulated time, for what is owed
_OWED_REAL_S = 0.01  # on a real robot
_ASK_AGAIN_S = 1.0
_STANDS = 0.05  # m/s and rad/s
_STALE = 2 * NANOSECONDS  # older odometry tells nothing of where the robot stands
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class RobotFailedError(InfrastructureError):
    """The robot, or what connects us with it, failed; it was told to stand."""


class Person(Protocol):
    """Whoever carries the robot to the start."""

    def answered(self) -> bool:
        """Whether they have said, since the last time, that it stands there. Waits for a moment."""


class RosPlatform(Platform):
    """One robot. connect: opens the transport; sensors: what is heard; person: who carries it to the start."""

    driven_by = DrivenBy.ROBOT
    resumable = True

    def __init__(
        self,
        stage: Stage,
        connect: Callable[[], Transport],
        connection: Connection,
        sensors: Collection[Sensor],
        person: Person,
        observer: Observer,
    ) -> None:
        self._stage, self._connect, self._connection = stage, connect, connection
        self._sensors, self._person, self._observer = frozenset(sensors), person, observer
        self._told = threading.Condition()
        self._transport: Transport | None = None
        self._listener: threading.Thread | None = None
        self._commands = self._closing = False
        self._simulated = False
        self._clock = 0
        self._bumper = self._stop = self._went = self._moving = False
        self._placed_at: int | None = None
        self._commanded_at = self._heard_at = 0
        self._heard_wall = 0.0
        self._fault = ""
        self._zero = self._now = self._hold = 0
        self._T_odom_start: SE2 | None = None
        self._greeted = True
        self._returned = False
        self.returns = connection.to_start == "goal"

    @property
    def zero_utc(self) -> datetime:
        """What t = 0 was by the robot's clock: UTC, unless that clock is simulated."""
        return _EPOCH + timedelta(microseconds=self._zero // 1000)

    @property
    def now(self) -> int:
        """Ns since zero."""
        return self._now

    def open(self) -> None:
        """Connect, and look at the robot: frames, clocks, commands, stop button. Nothing moves.

        Raises InputError: a sentence for each thing that is not as it must be.
        """
        self._observer.stage("looking at the robot")
        transport = self._transport = self._connect()
        self._encoder = RosEncoder(transport.store)
        self._hearing = Hearing(transport, self._stage.robot.rig, self._sensors, self._connection)
        transport.advertise(self._theirs(names.COMMAND), names.KINDS[names.COMMAND])
        self._commands = True
        transport.advertise(self._theirs(names.PLACE), names.KINDS[names.PLACE])
        wrong = list(self._subscribe())
        self._listener = threading.Thread(target=self._listen, name="listens to the robot", daemon=True)
        self._listener.start()
        began = time.monotonic()
        while (waited := time.monotonic() - began) < self._connection.look or (
            waited < _READY_S and not self._is_ready()
        ):
            time.sleep(_LOOK_EVERY_S)
        with self._told:
            wrong += self._hearing.understand()
            wrong += self._look()
        if wrong:
            raise InputError("the robot was looked at before it moves: " + "; ".join(wrong))
        for note in (*self._hearing.notes, *transport.complaints):
            self._observer.notice(note)
        self._zero = self._robot_now() // 1000 * 1000

    def go_on(self, now: int, placed: int, zero_utc: datetime) -> None:  # noqa: ARG002 a robot has no dice
        """Continue a tour that was interrupted. Raises InputError: the robot's clock is not past its rounds."""
        self._zero = (zero_utc - _EPOCH) // timedelta(microseconds=1) * 1000
        self._now = self._robot_now() - self._zero
        if self._now < now:
            raise InputError(
                f"the robot's clock is {(now - self._now) / NANOSECONDS:.0f} s before the end of the rounds that were"
                " driven already: it was set back; --overwrite begins anew"
            )

    def place(self, pose: SE2) -> str:
        """Have the robot put down: by a simulator that takes /taskslam/place, or by a person, who says so."""
        where = pose.in_words()
        by_itself, self._returned = self._returned, False
        if not by_itself and self._open_transport.readers(self._theirs(names.PLACE)):
            at = self._put_down(pose)
            self._T_odom_start = None
            said = f"put down at {where} by {names.PLACE}"
        else:
            at, self._T_odom_start = self._carried(where, by_itself)
            who = "the robot drove to the start" if by_itself else "a person put the robot at the start"
            said = f"{who} {where}; its odometry read {self._T_odom_start.in_words(3)} then"
        self._now = at - self._zero
        self._greeted = False
        return said

    def returned(self) -> None:
        """It has driven to the start: nobody is waited for."""
        self._returned = True

    def advance(self, until: int) -> Iterator[Measurement]:
        """Wait for the robot's time, and for what its sensors owe of it; what they said, in order.

        Whoever is late finds the robot's time gone on: `now` is then later than `until`.
        Raises RobotFailedError: the robot was told to stand, and why.
        """
        if not self._greeted:
            self._greeted = True
            self._command(0.0, 0.0)  # who waits for our first command goes on
        with self._told:
            self._wait_for_time(until + self._zero)
            ahead = self._robot_now() - self._zero
            self._now = until if ahead < until + _TICK else ahead
            target = self._now + self._zero - self._hold
            deadline = time.monotonic() + (_OWED_S if self._simulated else _OWED_REAL_S)
            while owed := self._hearing.owed(target):
                self._check()
                if (left := deadline - time.monotonic()) <= 0:
                    for sensor in owed:
                        self._hearing.give_up(sensor)
                    continue
                self._told.wait(left)
            self._check()
            said = self._hearing.pop(target)
        return iter([self._ours(measurement) for measurement in said])

    def drive(self, linear: float, angular: float) -> None:
        """Command body velocities, within the speed limits of the connection."""
        limits = self._connection.limits
        share = min([1.0, *(top / abs(v) for v, top in ((linear, limits.linear), (angular, limits.angular)) if v)])
        self._command(share * linear, share * angular)

    def halt(self) -> None:
        """Zero speed."""
        if self._commands and not self._closing:
            self._stand()

    def true_pose(self) -> None:
        """Cameras may know it; we do not."""

    def bumped(self) -> bool:
        """Whether the bumper was pressed since the last call."""
        with self._told:
            was, self._bumper = self._bumper, False
        return was

    def close(self) -> None:
        """Zero speed, and leave the graph; what was missed is said."""
        if self._transport is None or self._closing:
            return
        self.halt()
        self._closing = True
        if self._listener is not None:
            self._listener.join()
        time.sleep(_LOOK_EVERY_S)  # so that the last command is on its way
        self._transport.close()
        for sentence in self._missed():
            self._observer.notice(sentence)

    def _missed(self) -> Iterator[str]:
        """What was not understood, late, or not there, a sentence each."""
        for words, counted in (
            ("came too late", self._hearing.late),
            ("were not there in time", self._hearing.missing),
        ):
            for sensor, count in counted.items():
                yield f"{count} measurements of {sensor} {words}"
        yield from self._hearing.skipped.sentences()

    @property
    def _open_transport(self) -> Transport:
        assert self._transport is not None
        return self._transport

    def _theirs(self, topic: str) -> str:
        return self._connection.theirs(topic)

    def _robot_now(self) -> int:
        return self._clock if self._simulated else time.time_ns()

    def _subscribe(self) -> Iterator[str]:
        transport, stop = self._open_transport, self._connection.stop
        published = self._settled()
        yield from self._hearing.subscribe(published)
        self._simulated = published.get(names.CLOCK) == names.KINDS[names.CLOCK]
        for topic in (names.CLOCK, names.BUMPER, names.PLACED, names.GO):
            kind = names.KINDS[topic]
            if topic == names.GO or published.get(self._theirs(topic)) == kind:
                transport.subscribe(self._theirs(topic), kind, topic in names.LATCHED)
        if stop is not None:
            if published.get(stop) != "std_msgs/msg/Bool":
                found = published.get(stop, "published by nobody")
                yield f"the stop button: {stop} is {found}; expected std_msgs/msg/Bool"
            else:
                transport.subscribe(stop, "std_msgs/msg/Bool", latched=True)

    def _settled(self) -> Mapping[str, str]:
        """Who publishes what, once all that is wanted is there and nothing new has come for a while."""
        transport, wanted = self._open_transport, self._hearing.wanted().keys()
        published, changed = transport.published(), time.monotonic()
        latest = changed + max(self._connection.look, _READY_S)
        while (now := time.monotonic()) < latest and not (wanted <= published.keys() and now > changed + _SETTLED_S):
            time.sleep(_LOOK_EVERY_S)
            before, published = published, transport.published()
            if before.keys() != published.keys():
                changed = time.monotonic()
        return published

    def _is_ready(self) -> bool:
        """Whether what takes a while to be found is there."""
        return bool(self._open_transport.readers(self._theirs(names.COMMAND)))

    def _look(self) -> Iterator[str]:
        """What else must be as it should before anything moves, a sentence each."""
        if not self._open_transport.readers(self._theirs(names.COMMAND)):
            yield f"nobody reads {self._theirs(names.COMMAND)}, on which we command"
        if self._simulated and not self._clock:
            yield f"{names.CLOCK} is published, but nothing was said there in {self._connection.look:g} s"
        if self._stop:
            yield f"the stop button is pressed ({self._connection.stop})"
        bound, ages = round(self._connection.clock * NANOSECONDS), self._hearing.ages
        for topic, (age, _) in ages.items():
            if abs(age) > bound:
                side = "behind" if age > 0 else "ahead of"
                clock = names.CLOCK if self._simulated else "this machine's time: set both clocks by one server"
                yield f"stamps of {topic} are {abs(age) / NANOSECONDS:.2f} s {side} {clock}"
        if not self._simulated:
            self._hold = min(bound, max([0, *(most for _, most in ages.values())]))

    def _listen(self) -> None:
        """In a thread of its own: hears the robot, and has it stand where nothing fresh comes."""
        transport = self._open_transport
        while not self._closing:
            try:
                said = transport.hear(_LOOK_EVERY_S)
            except Exception as error:
                self._fail(f"the connection failed: {error}")
                return
            with self._told:
                for heard in said:
                    self._take(heard)
                self._told.notify_all()
            self._watch()

    def _take(self, heard: Heard) -> None:
        content = heard.content
        if heard.topic == names.CLOCK:
            now = content.clock.sec * NANOSECONDS + content.clock.nanosec
            if now < self._clock - NANOSECONDS:
                self._fault = self._fault or f"{names.CLOCK} went back by {(self._clock - now) / NANOSECONDS:.1f} s"
            self._clock = max(self._clock, now)
        elif heard.topic == self._theirs(names.BUMPER):
            self._bumper = self._bumper or bool(content.data)
        elif heard.topic == self._connection.stop:
            self._stop = bool(content.data)
            if self._stop:
                self._fault = self._fault or f"the stop button was pressed ({heard.topic})"
        elif heard.topic == self._theirs(names.GO):
            self._went = self._went or bool(content.data)
        elif heard.topic == self._theirs(names.PLACED):
            self._placed_at = content.header.stamp.sec * NANOSECONDS + content.header.stamp.nanosec
        else:
            self._hearing.take(heard, self._robot_now())
            newest = self._hearing.newest.get(Sensor.WHEEL_ODOMETRY, 0)
            if newest > self._heard_at:
                self._heard_at, self._heard_wall = newest, time.monotonic()

    def _watch(self) -> None:
        """The dead man: without a fresh command or a fresh pose the robot stands."""
        now, fresh = self._robot_now(), round(self._connection.fresh * NANOSECONDS)
        if self._moving and now - self._commanded_at > fresh:
            self._stand()
            self._observer.notice(f"no command for {self._connection.fresh:g} s: the robot was told to stand")
        if not self._is_under_way() or not self._heard_at:
            return
        odometry = self._theirs("/odom")
        stale = now - self._heard_at > fresh and time.monotonic() - self._heard_wall > self._connection.fresh / 2
        if stale:
            bad = "".join(f"; {sentence}" for sentence in self._hearing.skipped.sentences())
            self._fail(f"no odometry for {(now - self._heard_at) / NANOSECONDS:.1f} s on {odometry}{bad}")
        elif not self._open_transport.writers(odometry):
            self._fail(f"nobody publishes {odometry} any more")
        elif not self._open_transport.readers(self._theirs(names.COMMAND)):
            self._fail(f"nobody reads {self._theirs(names.COMMAND)} any more")
        elif self._fault:
            self._stand()

    def _is_under_way(self) -> bool:
        """Whether anybody has the robot move on our behalf."""
        return self._moving

    def _stand(self) -> None:
        """Have the robot stand, whoever has it move on our behalf."""
        self._command(0.0, 0.0)

    def _fail(self, words: str) -> None:
        """Remember why, for the main thread to tell; stand."""
        with self._told:
            self._fault = self._fault or words
            self._told.notify_all()
        self._stand()

    def _check(self) -> None:
        """Raise RobotFailedError if something is wrong."""
        if self._fault:
            raise RobotFailedError(f"{self._fault}: the robot was told to stand")

    def _command(self, linear: float, angular: float) -> None:
        with self._told:
            self._commanded_at = self._robot_now()
            self._moving = (linear, angular) != (0.0, 0.0)
        message: Any = self._encoder.twist(linear, angular)
        try:
            with undisturbed():  # half a command must not stay in the robot's socket
                self._open_transport.publish(self._theirs(names.COMMAND), message)
        except SlowReaderError as error:
            with self._told:
                self._fault = self._fault or str(error)

    def _wait_for_time(self, instant: int) -> None:
        """Until the robot's clock shows it."""
        shown, since = self._robot_now(), time.monotonic()
        while (now := self._robot_now()) < instant:
            self._check()
            if now > shown:
                shown, since = now, time.monotonic()
            elif time.monotonic() - since > _PATIENCE_S:
                raise RobotFailedError(f"{names.CLOCK} has stood for {_PATIENCE_S:g} s: the robot was told to stand")
            left_s = _LOOK_EVERY_S * 5 if self._simulated else (instant - now) / NANOSECONDS
            self._told.wait(left_s)
        self._check()

    def _put_down(self, pose: SE2) -> int:
        """Where a simulator is at the other end: at which of its instants it was done."""
        with self._told:
            if self._commanded_at:
                self._wait_for_time(self._commanded_at + _TICK)  # our last command must not come after it
            self._placed_at = None
            asked = self._encoder.pose_stamped(self._robot_now(), MAP, pose)
        deadline = time.monotonic() + _PATIENCE_S
        with self._told:
            while (at := self._placed_at) is None:
                self._check()
                if time.monotonic() > deadline:
                    raise RobotFailedError(f"{names.PLACE}: the robot was not put down within {_PATIENCE_S:g} s")
                self._open_transport.publish(self._theirs(names.PLACE), asked)  # the first may be lost in ROS 2
                self._told.wait_for(lambda: self._placed_at is not None, _ASK_AGAIN_S)
            self._hearing.begin(at, from_zero=True)
            self._heard_at = 0
        return at

    def _carried(self, where: str, is_there: bool) -> tuple[int, SE2]:
        """Wait until the robot stands at the start, and a person says so; when, and its odometry.

        is_there: it has come by itself, and nobody is asked.
        """
        self.halt()
        if not is_there:
            self._observer.notice(
                f"put the robot at the start {where}, then press Enter here, or publish true on {names.GO}"
            )
        with self._told:
            self._went = False
        odometry: WheelOdometry | None = None
        while True:
            said = is_there or self._person.answered()
            with self._told:
                self._check()
                now = self._robot_now()
                waiting = self._hearing.pop(now)  # nobody else takes what is said meanwhile
                said, self._went = said or self._went, False
                odometry = next((one for one in reversed(waiting) if isinstance(one, WheelOdometry)), odometry)
                if not said or (is_there and not (odometry and _stands(odometry))):
                    self._told.wait(_LOOK_EVERY_S)
                    continue
                if odometry is not None and _stands(odometry) and now - odometry.stamp <= _STALE:
                    self._hearing.begin(now, from_zero=False)
                    return now, odometry.T_odom_base
            self._observer.notice("its odometry says that the robot moves, or nothing: let it stand, and say so again")

    def _ours(self, measurement: Measurement) -> Measurement:
        """On our clock, odometry from where the robot was put down."""
        if isinstance(measurement, WheelOdometry) and self._T_odom_start is not None:
            T = self._T_odom_start.inverse() @ measurement.T_odom_base
            measurement = WheelOdometry(measurement.stamp, T, measurement.linear, measurement.angular)
        return shifted(measurement, -self._zero)


def _stands(odometry: WheelOdometry) -> bool:
    return max(abs(odometry.linear), abs(odometry.angular)) <= _STANDS
