"""The simulator as a robot in somebody's ROS graph: what Gazebo gives them, without Gazebo (docs/ros.md).

Said: /clock, /tf and /tf_static, the topics of every sensor that somebody reads, /bumper, /map. Heard: /cmd_vel, and
/taskslam/place, by which the robot is put down elsewhere as a simulator can. The true pose goes into the record alone,
unless the record says that it was published.

A control period is simulated, all of it is said, and then the other side has its turn (`pace.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from taskslam.benchmark.pace import Pace
from taskslam.benchmark.run import build_simulator, machine, versions
from taskslam.benchmark.stage import Stage
from taskslam.datasets import ros_decoding
from taskslam.datasets.ros_encoding import MAP, TRUTH
from taskslam.errors import DatasetError, InputError
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, Measurement, WheelOdometry
from taskslam.observer import Observer
from taskslam.record.served import Served, ServedRecord
from taskslam.ros import names
from taskslam.ros.encoding import EPOCH, NodeEncoder, Odometer
from taskslam.ros.transport import Heard, SlowReaderError, Transport
from taskslam.sensors import fitted
from taskslam.stopping import StoppedError, undisturbed

_CLOCK_STEP = NANOSECONDS // 100  # /clock goes on at least so finely: a node may sleep in simulated time
_LOOK_EVERY_S = 0.05


@dataclass(frozen=True)
class ServeSettings:
    """How the robot is served.

    period: s, of control; factor: times real time, None for in step with the other side; patience_s: for a side that
    drives (`pace.py`); seconds: simulated, after which it ends by itself, None for never; publish_truth: on
    /ground_truth/odom, and the record says so.
    """

    ros: int = 1
    seed: int = 0
    period: float = 0.05
    factor: float | None = None
    patience_s: float = 10.0
    seconds: float | None = None
    publish_truth: bool = False

    @property
    def words(self) -> str:
        """The pace, for people."""
        if self.factor is None:
            return f"in step with {names.COMMAND}, waiting up to {self.patience_s:g} s for a side that drives"
        return f"{self.factor:g} times real time"


def serve(
    stage: Stage, transport: Transport, settings: ServeSettings, out: Path, observer: Observer | None = None
) -> Served:
    """Serve the robot of a stage until its time is over or a signal asks to end; what its record says.

    The transport is closed by the caller. Raises InputError: the period is no whole number of clock steps; RecordError:
    `out` exists; ScenarioError, SimulatorFailedError, DiskFullError.
    """
    period = round(settings.period * NANOSECONDS)
    if period < _CLOCK_STEP or period % _CLOCK_STEP:
        raise InputError(f"--period {settings.period:g}: expected a multiple of {_CLOCK_STEP / NANOSECONDS:g} s")
    served = Served(
        scenario=stage.scenario.model_dump(mode="json"),
        robot=stage.robot.model_dump(mode="json"),
        seed=settings.seed,
        ros=settings.ros,
        variables=dict(transport.variables),
        pace=settings.words,
        epoch=EPOCH,
        publishes_truth=settings.publish_truth,
        versions=versions(),
        machine=machine(),
        started_utc=datetime.now(UTC).isoformat(),
    )
    observer = observer or Observer()
    observer.stage("building the simulator")
    robot = _ServedRobot(stage, transport, settings, observer)
    with ServedRecord(out, served) as record:
        return robot.live(record, period)


class _ServedRobot:
    """The robot and its life in the graph."""

    def __init__(self, stage: Stage, transport: Transport, settings: ServeSettings, observer: Observer) -> None:
        self._stage, self._transport, self._settings, self._observer = stage, transport, settings, observer
        rig = stage.robot.rig
        self._simulator = build_simulator(stage, settings.seed, fitted(rig))
        self._encoder = NodeEncoder(transport.store, rig, {})
        self._odometer = Odometer()
        self._pace = Pace(settings.period, settings.factor, settings.patience_s)
        self._shown = self._transformed = -1
        self._placed = self._messages = 0
        self._commands: list[tuple[float, float]] = []
        self._commander = ""
        self._bumped = False
        self._asked_at: Any = None
        self._placed_answer: Any = None
        self._said: set[str] = set()
        self._handle: dict[str, Callable[[Heard], None]] = {names.COMMAND: self._command, names.PLACE: self._place}
        self._topics = {
            sensor: [name for topic in kind.topics for name in _names(topic.name)]
            for sensor, kind in fitted(rig).items()
            if kind.bag
        }

    def live(self, record: ServedRecord, period: int) -> Served:
        """From the first period to the last."""
        self._record = record
        self._put_down(self._stage.scenario.start.pose)
        self._simulator.go_on(0, 0)  # whoever puts it down first meets the noise of a first round
        self._open_topics()
        last = None if self._settings.seconds is None else round(self._settings.seconds * NANOSECONDS)
        try:
            while last is None or self._simulator.now < last:
                with undisturbed():  # half a message must not stay in anybody's socket
                    self._run_period(period)
                    if self._pace.passed():
                        self._notice(
                            "a command was waited for in vain while the robot was not told to stand: time goes on in"
                            " real time until one comes"
                        )
                self._await_turn()
        except StoppedError as stopped:
            self._notice(f"{stopped}: the robot stands, nothing more is served")
        self._come_to_rest(period)
        now = self._simulator.now
        return record.end(now, now / NANOSECONDS, self._pace.vain, self._messages)

    def _open_topics(self) -> None:
        transport = self._transport
        for sensor, kind in fitted(self._stage.robot.rig).items():
            for topic in kind.topics if sensor in self._topics else ():
                for name in _names(topic.name):
                    transport.advertise(name, topic.kind)
        others = [names.CLOCK, names.TF, names.TF_STATIC, names.MAP_TOPIC, names.BUMPER, names.PLACED]
        for name in others:
            transport.advertise(name, names.KINDS[name], name in names.LATCHED)
        if self._settings.publish_truth:
            transport.advertise(TRUTH, "nav_msgs/msg/Odometry")
        encoder = self._encoder
        self._say(names.TF_STATIC, encoder.mounts(0, encoder.mounted.items()))
        self._say(names.MAP_TOPIC, encoder.floor_plan(0, self._stage.plan))
        self._say(names.BUMPER, encoder.new("std_msgs/msg/Bool", data=False))
        for name in self._handle:
            transport.subscribe(name, names.KINDS[name])

    def _run_period(self, period: int) -> None:
        """One period of the robot's life, and all that its sensors have to say of it."""
        simulator = self._simulator
        until = simulator.now + period
        while simulator.now < until:
            for measurement in simulator.advance(simulator.now + _CLOCK_STEP):
                self._tell(measurement)
            self._show(simulator.now)
        pose = simulator.true_pose()
        self._record.truth(until + EPOCH, pose)
        if self._settings.publish_truth:
            self._say(TRUTH, self._encoder.truth(until, pose)[2])
        if (bumped := simulator.bumped()) != self._bumped:
            self._bumped = bumped
            self._say(names.BUMPER, self._encoder.new("std_msgs/msg/Bool", data=bumped))
            if bumped:
                self._notice("the bumper is pressed")
        self._observer.ticked(until)

    def _tell(self, measurement: Measurement) -> None:
        """Transforms up to its stamp, the clock, and then the messages, where anybody reads them."""
        if isinstance(measurement, WheelOdometry):
            self._odometer.newest = measurement
        stamp = measurement.stamp
        if stamp > self._transformed and (at := self._odometer.at(stamp)) is not None:
            self._transformed = stamp
            self._say(names.TF, self._encoder.base_in_odom(stamp, at))
        self._show(stamp)
        if any(self._transport.readers(topic) for topic in self._topics.get(measurement.sensor, ())):
            for topic, message in self._encoder.utterance(measurement).messages:
                called = _names(topic)
                for name in called:
                    if len(called) == 1 or self._transport.readers(name):
                        self._say(name, message)

    def _show(self, now: int) -> None:
        """/clock, which never goes back."""
        if now > self._shown:
            self._shown = now
            self._say(names.CLOCK, self._encoder.new(names.KINDS[names.CLOCK], clock=self._encoder.time(now)))

    def _say(self, topic: str, message: Any) -> None:
        self._messages += 1
        try:
            self._transport.publish(topic, message)
        except SlowReaderError as error:
            self._notice(f"{error}; it is told nothing more")

    def _await_turn(self) -> None:
        """Hear the other side until the next period may pass, and take its last command."""
        while True:
            said = self._transport.hear(min(self._pace.left_s(), _LOOK_EVERY_S))
            with undisturbed():
                for heard in said:
                    self._handle[heard.topic](heard)
                for words in self._transport.complaints:
                    self._notice_once(words)
                if self._commander and not self._transport.writers(names.COMMAND):
                    self._left_alone()
            if self._pace.left_s() <= 0:
                break
        if self._commands:
            self._simulator.drive(*self._commands[-1])
            self._commands = []

    def _left_alone(self) -> None:
        self._notice(f"{self._commander} is gone and nobody commands any more: zero speed")
        self._commander, self._commands = "", [(0.0, 0.0)]
        self._pace.alone()

    def _command(self, heard: Heard) -> None:
        linear, angular = float(heard.content.linear.x), float(heard.content.angular.z)
        by = heard.by or "who commanded"
        if not (math.isfinite(linear) and math.isfinite(angular)):
            self._notice_once(f"{by} commands a speed that is not finite: zero speed")
            linear = angular = 0.0
        if self._commander not in ("", by):
            first, second = sorted((self._commander, by))
            self._notice_once(f"{first} and {second} both command on {names.COMMAND}: the last one counts")
        self._commander = by
        self._commands.append((linear, angular))
        self._pace.commanded(moving=(linear, angular) != (0.0, 0.0))

    def _place(self, heard: Heard) -> None:
        message, by = heard.content, heard.by or "somebody"
        stamp = message.header.stamp
        if stamp == self._asked_at and (stamp.sec or stamp.nanosec):  # again, as the answer did not arrive
            self._say(names.PLACED, self._placed_answer)
            return
        frame = message.header.frame_id.lstrip("/")
        try:
            pose = SE2.from_matrix(ros_decoding.pose_message(message.pose))
        except DatasetError as error:
            self._notice(f"{by} would put the robot at {error}: it stays where it is")
            return
        at = pose.in_words()
        if frame != MAP:
            self._notice(f"{by} would put the robot down in the frame '{frame}': expected '{MAP}'")
        elif self._simulator.touches(pose):
            self._notice(f"{by} would put the robot at {at}, where it touches something: it stays where it is")
        else:
            self._put_down(pose)
            self._commands = []
            self._notice(f"{by} put the robot at {at}")
            self._pace.placed()
            self._asked_at = stamp
            self._placed_answer = self._encoder.pose_stamped(self._simulator.now, MAP, pose)
            self._say(names.PLACED, self._placed_answer)
            self._placed += 1

    def _put_down(self, pose: SE2) -> None:
        self._simulator.reset(pose)
        self._odometer = Odometer()

    def _come_to_rest(self, period: int) -> None:
        """Zero speed, for as long as the robot may need to come to rest."""
        drive = self._stage.robot.drive
        rest_s = max(
            drive.max_linear / drive.max_linear_acceleration, drive.max_angular / drive.max_angular_acceleration
        )
        self._simulator.drive(0.0, 0.0)
        until = self._simulator.now + round(rest_s * NANOSECONDS)
        while self._simulator.now < until:
            self._run_period(period)

    def _notice_once(self, text: str) -> None:
        if text not in self._said:
            self._said.add(text)
            self._notice(text)

    def _notice(self, text: str) -> None:
        self._record.notice(self._simulator.now, self._placed, text)
        self._observer.notice(text)


def _names(topic: str) -> list[str]:
    """The names under which a topic is said."""
    return [topic, *filter(None, [names.ALSO.get(topic)])]
