"""`Hearing`: a robot's topics as measurements, in stamp order.

At first messages are only kept, for a look at frames, kinds and rates; once they are understood, every further one is
decoded. Stamps are the robot's own, ns. Nothing here waits: who asks says how long it is worth to wait for what is due.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from pydantic import ValidationError

from taskslam.datasets import bag_rig, ros_decoding
from taskslam.datasets.bag_cameras import info_beside
from taskslam.datasets.bag_sensor import BagSensor, bag_sensor
from taskslam.datasets.dataset import order
from taskslam.datasets.stamp_order import Pairing
from taskslam.errors import DatasetError, did_you_mean
from taskslam.measurements import NANOSECONDS, Measurement, Sensor
from taskslam.robot import SensorRig
from taskslam.ros import names
from taskslam.ros.connection import Connection
from taskslam.ros.transport import Heard, Transport
from taskslam.sensors import sensor_kind
from taskslam.skipped import Skipped
from taskslam.user_files import complaint

_HEAD = 100  # messages of a topic that are kept for the look
_JITTER = 1_000  # ns: within it, a stamp is as it was expected
_INFO = "sensor_msgs/msg/CameraInfo"


class Hearing:
    """The sensors of one robot. notes: what of them was guessed, or not believed.

    missing: how often what a sensor owed was not there in time; late: how often it came after what is younger had been
    taken, of which nothing was made. ages: by topic, ns, how old a message was when it came during the look, below zero
    where it was ahead of the clock: nearest to zero, which tells of clocks, since one message or one tick may always be
    late; and at most, which tells of the way.
    """

    def __init__(
        self, transport: Transport, rig: SensorRig, sensors: Collection[Sensor], connection: Connection
    ) -> None:
        self._transport, self._rig, self._connection = transport, rig, connection
        self.sensors = sorted(sensors, key=lambda sensor: sensor_kind(sensor).rank)
        self.notes: list[str] = []
        self.skipped = Skipped()
        self.missing: Counter[str] = Counter()
        self.late: Counter[str] = Counter()
        self.frames = bag_rig.Frames([], connection.base, None, {})
        self.periods: dict[Sensor, int] = {}
        self.newest: dict[Sensor, int] = {}
        self._heads: dict[str, list[Any]] = {}
        self._roles: dict[str, tuple[str, Sensor]] = {}
        self._decoders: dict[Sensor, BagSensor] = {}
        self._pairings = {sensor: Pairing(self.skipped) for sensor in self.sensors}
        self._due: dict[Sensor, int] = {}
        self._waiting: list[Measurement] = []
        self._taken = self._since = -1
        self.ages: dict[str, tuple[int, int]] = {}

    def wanted(self) -> dict[str, tuple[str, Sensor]]:
        """The robot's topics that must be there, with their types and sensors."""
        return {
            self._connection.theirs(topic.name): (topic.kind, sensor)
            for sensor in self.sensors
            for topic in sensor_kind(sensor).topics
            if topic.role
        }

    def subscribe(self, published: Mapping[str, str]) -> Iterator[str]:
        """Hear what is there of what is wanted; a sentence for each topic that is not."""
        wanted = self.wanted()
        for topic, (kind, sensor) in wanted.items():
            if topic not in published:
                alike = [name for name, one in published.items() if one == kind]
                near = f"; of its type there is {', '.join(alike)}" if alike else did_you_mean(topic, published)
                yield f"nobody publishes {topic} ({sensor}, {kind}){near}"
            elif published[topic] != kind:
                yield f"{topic} is of the type {published[topic]}; expected {kind}"
            else:
                self._roles[topic] = self._role(topic), sensor
                self._transport.subscribe(topic, kind)
                beside = info_beside(topic)
                if published.get(beside) == _INFO and beside not in self._heads:
                    self._heads[beside] = []
                    self._transport.subscribe(beside, _INFO)
        if names.TF_STATIC in published:
            self._transport.subscribe(names.TF_STATIC, names.KINDS[names.TF_STATIC], latched=True)

    def understand(self) -> Iterator[str]:
        """From now on, decode; a sentence for everything that the first messages do not tell, or tell wrongly."""
        transforms = [one for message in self._heads.get(names.TF_STATIC, []) for one in message.transforms]
        odometry = self._heads.get(self._connection.theirs("/odom"), [])
        child = odometry[0].child_frame_id.lstrip("/") if odometry else None
        try:
            self.frames = bag_rig.Frames(transforms, self._connection.base, child, {})
        except DatasetError as error:
            yield f"{names.TF_STATIC}: {error}"
        for sensor in self.sensors:
            kind = sensor_kind(sensor)
            topics = [topic for topic, (_, of) in self._roles.items() if of == sensor]
            if len(topics) < sum(bool(topic.role) for topic in kind.topics):
                continue  # which of them is not there was said
            if silent := [topic for topic in topics if not self._heads.get(topic)]:
                yield f"{' and '.join(silent)}: nothing was said there in {self._connection.look:g} s"
                continue
            try:
                self._decoders[sensor] = bag_sensor(kind)(self, kind.part_of(self._rig))
            except (DatasetError, ValidationError) as error:
                yield f"{sensor}: {complaint(error) if isinstance(error, ValidationError) else error}"
                continue
            yield from self._rate(sensor)
            yield from self._place(sensor)

    def take(self, heard: Heard, now: int) -> None:
        """What was heard on any topic, at an instant by the robot's clock."""
        if heard.topic not in self._roles or not self._decoders:
            head = self._heads.setdefault(heard.topic, [])
            if len(head) < _HEAD:
                head.append(heard.content)
                if heard.topic in self._roles and now:  # before /clock was heard, there is no age
                    age = now - ros_decoding.stamp_of(heard.content)
                    nearest, most = self.ages.get(heard.topic, (age, age))
                    self.ages[heard.topic] = min(age, nearest, key=abs), max(age, most)
            return
        role, sensor = self._roles[heard.topic]
        try:
            measurement = self._decoders[sensor].measurement(role, heard.content, self._pairings[sensor])
        except DatasetError as error:
            self.skipped.add(f"messages of {heard.topic}", str(error))
            return
        if measurement is None or measurement.stamp <= self._since:
            return
        if measurement.stamp <= self.newest.get(sensor, -1) or measurement.stamp < self._taken:
            self.late[sensor] += 1
            return
        self.newest[sensor] = measurement.stamp
        self._due[sensor] = measurement.stamp + self.periods[sensor]
        self._waiting.append(measurement)

    def owed(self, until: int) -> list[Sensor]:
        """The sensors that should have said something of an instant up to that, and have not yet."""
        return [sensor for sensor, due in self._due.items() if due <= until + _JITTER]

    def give_up(self, sensor: Sensor) -> None:
        """Do not wait for what a sensor owes."""
        self.missing[sensor] += 1
        self._due[sensor] += self.periods[sensor]

    def pop(self, until: int) -> list[Measurement]:
        """What was measured up to that instant and not taken yet, in order."""
        ready = sorted((one for one in self._waiting if one.stamp <= until), key=order)
        self._waiting = [one for one in self._waiting if one.stamp > until]
        if ready:
            self._taken = ready[-1].stamp
        return ready

    def begin(self, now: int, from_zero: bool) -> None:
        """The robot was put down at that instant: what is older is forgotten. from_zero: its sensors begin anew."""
        self._waiting = [one for one in self._waiting if one.stamp > now]
        self._taken = self._since = now
        for sensor in self._decoders if from_zero else ():
            newest = max((one.stamp for one in self._waiting if one.sensor == sensor), default=now)
            self._due[sensor] = newest + self.periods[sensor]

    def topic(self, role: str) -> str:
        """The robot's topic of a role."""
        return next(topic for topic, (of, _) in self._roles.items() if of == role)

    def has(self, topic: str) -> bool:
        """Whether the robot publishes it."""
        return bool(self._heads.get(topic))

    def first(self, topic: str) -> list[Any]:
        """The first messages of a topic. Raises DatasetError where there is none."""
        if not (head := self._heads.get(topic)):
            raise DatasetError(f"{topic}: nothing was said there")
        return head[:5]

    def note(self, sentence: str) -> None:
        """Say what was guessed, or not believed."""
        self.notes.append(sentence)

    def _role(self, topic: str) -> str:
        for sensor in self.sensors:
            for ours in sensor_kind(sensor).topics:
                if ours.role and self._connection.theirs(ours.name) == topic:
                    return ours.role
        raise AssertionError(f"{topic} was not wanted")

    def _rate(self, sensor: Sensor) -> Iterator[str]:
        """Its period, by what was heard of it; IMU and odometry tell it by their messages, as cameras do."""
        sheet = float(sensor_kind(sensor).part_of(self._rig).rate)
        topic = next(topic for topic, (_, of) in self._roles.items() if of == sensor)
        head = self._heads[topic]
        rate = bag_rig.rate_or_none(head)
        if rate is None:
            yield f"{topic}: {len(head)} message in {self._connection.look:g} s; expected {sheet:g} Hz"
            return
        if not 0.5 < rate / sheet < 2.0:
            self.notes.append(f"{topic} comes at {rate:.3g} Hz; the robot's description says {sheet:g} Hz")
        self.periods[sensor] = round(NANOSECONDS / (sheet if abs(rate / sheet - 1.0) < 0.02 else rate))

    def _place(self, sensor: Sensor) -> Iterator[str]:
        """Where it sits by /tf_static, held against the robot's description."""
        part = sensor_kind(sensor).part_of(self._rig)
        ours = bag_sensor(sensor_kind(sensor)).frames(part)
        topic = next(topic for topic, (_, of) in self._roles.items() if of == sensor)
        if not ours:
            return
        frame = self._heads[topic][0].header.frame_id
        if not self._heads.get(names.TF_STATIC):
            self.notes.append(
                f"{names.TF_STATIC} says nothing of '{frame}': it is where the robot's description has it"
            )
            return
        try:
            T = self.frames.T_base(frame)
        except DatasetError:
            yield (
                f"no static transform connects the frame '{frame}' of {topic} to the base '{self.frames.base}';"
                f" expected one on {names.TF_STATIC}"
            )
            return
        off = min(float(abs(T[:3, 3] - ours_T[:3, 3]).max()) for _, ours_T in ours)
        if off > 0.02:
            self.notes.append(
                f"{names.TF_STATIC} has '{frame}' {off * 100:.0f} cm from where the robot's description has it: the"
                " description counts"
            )
