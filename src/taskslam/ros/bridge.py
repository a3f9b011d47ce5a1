"""Between the rules of lockstep and a node of somebody's: all that is the same whichever ROS it speaks."""

from __future__ import annotations

import queue
import time
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from rosbags.typesys.store import Typestore

from taskslam.errors import InputError, did_you_mean
from taskslam.measurements import NANOSECONDS, Measurement, WheelOdometry
from taskslam.robot import SensorRig
from taskslam.ros.encoding import NodeEncoder, Odometer, PoseReader, Utterance, unknown_frames
from taskslam.ros.errors import NodeEndedError, RosError
from taskslam.ros.lockstep import Answer, Answers, Lockstep
from taskslam.ros.node_file import ALWAYS, CLOCK, TF, NodeFile
from taskslam.ros.process import NodeProcess, processor_time
from taskslam.sensors import sensor_kind
from taskslam.slam.base import InvalidOutputError, StalledError

ROSOUT = "/rosout"
TF_TYPE, CLOCK_TYPE = "tf2_msgs/msg/TFMessage", "rosgraph_msgs/msg/Clock"
WAITING_FROM = -600 * NANOSECONDS  # where the clock begins while a node gets ready
US = "taskslam"
_LOOK_EVERY_S = 0.02
_SETTLED_S = 0.25  # without anything new, a node has said all that it publishes and reads
_LATE_S = 2.0  # so long a node that is ready else may take to offer its answer before it is given a frame
_MOST_WARNINGS = 5
_LONGEST_WARNING = 200
_ONE_ALONE = "expected one of them alone"


@dataclass(frozen=True, slots=True)
class View:
    """Who else publishes and reads what: nodes' names by topic; the topics' types, as sensor_msgs/LaserScan."""

    publishers: Mapping[str, Sequence[str]]
    readers: Mapping[str, Sequence[str]]
    types: Mapping[str, str]


class Bridge(ABC):
    """One life of a node: a `Wire` for `Lockstep`. Open with `shake_hands`, and `close` in any case."""

    def __init__(self, node: NodeFile, rig: SensorRig, store: Typestore) -> None:
        """The encoder of a robot's measurements. Raises InputError: the file does not fit the robot."""
        self._file = node
        self._process: NodeProcess | None = None
        self.warnings: list[str] = []
        self.odometer = Odometer()
        self._encoder = NodeEncoder(store, rig, node.frames, node.clouds_from)
        self._reader = PoseReader(node.answer, self._encoder, self.odometer)
        self._inbox: queue.SimpleQueue[tuple[str, bytes | bytearray]] = queue.SimpleQueue()
        self._speakers: set[str] = set()
        self._transformed = -1
        self._processes: set[int] = set()
        kinds = [sensor_kind(sensor) for sensor in node.sensors]
        self._ours = {topic.name: topic.kind for kind in kinds for topic in kind.topics}
        self._topics = {node.called(topic): kind for topic, kind in self._ours.items()}
        self._awaited = [node.called(topic.name) for topic in sensor_kind(node.awaited).topics if topic.role]
        self._first_frame_at: float | None = None
        self._offered = False

    @abstractmethod
    def close(self) -> None:
        """End the node, and what we spoke to it with. Idempotent."""

    @abstractmethod
    def findings(self) -> Iterator[str]:
        """What may be wrong with the node file, or with the node, though it answers: a sentence each."""

    @abstractmethod
    def _view(self) -> View: ...

    @abstractmethod
    def _publish(self, topic: str, message: Any) -> None:
        """On one of our topics, by its name in the table of sensors."""

    @abstractmethod
    def _decode(self, data: bytes | bytearray) -> Any:
        """A message of the answer's topic. Raises RosError."""

    @abstractmethod
    def _unconnected(self, view: View) -> Iterator[str]:
        """Ends of topics that have not found each other yet, a sentence each."""

    @abstractmethod
    def _complaints(self) -> Sequence[str]:
        """Why peers were refused, or refused us."""

    @abstractmethod
    def _connected(self) -> None:
        """What there is to be done once the node is connected. Raises InputError."""

    def _unfit(self, view: View) -> Iterator[str]:
        """What can never fit, a sentence each."""
        topic, kind = self._answers_on, self._answers_as.replace("/msg/", "/")
        if topic in view.publishers and view.types.get(topic) != kind:
            yield f"{topic} is of the type {view.types.get(topic)}; expected {kind}"
        for held in self._topics:
            if others := view.publishers.get(held):
                yield f"{_and([f'/{US}', *others])} both publish {held}; {_ONE_ALONE}"
        if topic != TF and len(names := view.publishers.get(topic, ())) > 1:
            yield f"{_and(names)} both publish {topic}; {_ONE_ALONE}"

    def _fallen_silent(self) -> str:
        """How the node, or what we hear it by, has ended; empty if it has not."""
        return "" if self._node.alive else self._node.ending()

    def shake_hands(self, lockstep: Lockstep) -> None:
        """Wait until the node is connected, the clock going on meanwhile; then reset it, where a service does that.

        A node may offer its answer as late as after its first frame. Raises InputError: it is not connected within its
        time, it ended, or two nodes say the same.
        """
        deadline = time.monotonic() + self._file.start
        seen, since = self._view(), time.monotonic()
        while True:
            now, view = time.monotonic(), self._view()
            if view != seen:
                seen, since = view, now
            if ending := self._fallen_silent():
                raise InputError(f"{ending}{self._warned()}, before it was connected")
            unready, missing = list(self._unready(view)), self._missing_answer(view)
            if now - since >= _SETTLED_S and (unfit := list(self._unfit(view))):
                raise InputError("; ".join(unfit))
            if not unready and now - since >= (_LATE_S if missing else _SETTLED_S):
                break
            if now > deadline:
                missed = [missing] if missing else []
                raise InputError("; ".join([*unready, *missed, *self._complaints()]) + self._warned())
            lockstep.tick(below=0)
            time.sleep(_LOOK_EVERY_S)
        self._connected()

    def utterance(self, measurement: Measurement) -> Utterance:
        """A measurement as the node will be told it."""
        if isinstance(measurement, WheelOdometry):
            self.odometer.newest = measurement
        return self._encoder.utterance(measurement)

    def transforms(self, until: int) -> None:
        """The base in `odom` at that instant, once."""
        if until > self._transformed and (at := self.odometer.at(until)) is not None:
            self._transformed = until
            self._publish(TF, self._encoder.base_in_odom(until, at))

    def clock(self, now: int) -> None:
        """/clock."""
        self._publish(CLOCK, self._encoder.new(CLOCK_TYPE, clock=self._encoder.time(now)))

    def say(self, saying: Utterance) -> None:
        """All messages of a measurement."""
        for topic, message in saying.messages:
            self._publish(topic, message)
            if self._first_frame_at is None and self._file.called(topic) in self._awaited:
                self._first_frame_at = time.monotonic()

    def hear(self, longest_s: float) -> Sequence[Answer]:
        """Poses that the node has said.

        Raises NodeEndedError; StalledError: nobody offers an answer; InvalidOutputError: it says what is no pose.
        """
        try:
            heard = [self._inbox.get(timeout=longest_s)]
        except queue.Empty:
            if ending := self._fallen_silent():
                raise NodeEndedError(f"{ending}{self._warned()}") from None
            self._check_offered()
            return ()
        with suppress(queue.Empty):
            while True:
                heard.append(self._inbox.get_nowait())
        self._speakers.update(name for name, _ in heard)
        if self._file.answer.topic and len(self._speakers) > 1:
            raise InvalidOutputError(f"poses of {_and(self._speakers)}; {_ONE_ALONE}")
        answers = [answer for _, data in heard if (answer := self._answer(data)) is not None]
        self._offered |= bool(answers)
        return answers

    def worked(self) -> float:
        """Processor time of the node so far, s."""
        return self.processor_time() / NANOSECONDS

    def processor_time(self) -> int:
        """The same in ns."""
        return processor_time(self._processes)

    @property
    def _node(self) -> NodeProcess:
        assert self._process is not None
        return self._process

    @property
    def _answers_on(self) -> str:
        return self._file.answer.topic or TF

    @property
    def _answers_as(self) -> str:
        short = self._file.answer.type
        return short.replace("/", "/msg/") if short else TF_TYPE

    def _given(self) -> dict[str, Any]:
        """All parameters by the file's names, those of the robot worked out."""
        given: dict[str, Any] = {name: self._beside(value) for name, value in self._file.parameters.items()}
        given |= {name: self._encoder.extrinsic(wanted) for name, wanted in self._file.extrinsics.items()}
        return given | {name: self._encoder.intrinsic(wanted) for name, wanted in self._file.intrinsics.items()}

    def _beside(self, value: Any) -> Any:
        match value:
            case str():
                return self._file.beside(value)
            case list():
                return [self._beside(part) for part in value]
            case dict():
                return {key: self._beside(part) for key, part in value.items()}
        return value

    def _mounts(self) -> Any:
        """What /tf_static says."""
        return self._encoder.mounts(WAITING_FROM, list(self._encoder.mounted.items()))

    def _answer(self, data: bytes | bytearray) -> Answer | None:
        try:
            return self._reader.read(self._decode(data))
        except RosError as error:
            raise InvalidOutputError(f"on {self._answers_on} what is {error}") from error

    def _warn(self, publisher: str, words: str) -> None:
        said = f'{publisher} warns: "{" ".join(words.split())[:_LONGEST_WARNING]}"'
        if said not in self.warnings:
            self.warnings = [*self.warnings, said][-_MOST_WARNINGS:]

    def _warned(self) -> str:
        return "".join(f"; {words}" for words in self.warnings[-2:])

    def _unready(self, view: View) -> Iterator[str]:
        """What is missing before the first measurement can be said, a sentence each."""
        for topic in self._awaited:
            if not view.readers.get(topic):
                others = [other for other in view.readers if not other.startswith(("/tf", CLOCK, "/parameter_events"))]
                reads = f"the node reads {', '.join(sorted(others))}" if others else "the node reads no topic"
                yield f"nobody reads {topic}: {reads}.{did_you_mean(topic, others)}"
        yield from self._unconnected(view)

    def _missing_answer(self, view: View) -> str:
        """That nobody offers the answer, in words; empty if somebody does."""
        topic = self._answers_on
        if view.publishers.get(topic):
            return ""
        others = [other for other in view.publishers if other not in (ROSOUT, "/parameter_events")]
        says = f"the node publishes {', '.join(sorted(others))}" if others else "the node publishes nothing"
        return f"nobody publishes {topic}: {says}.{did_you_mean(topic, others)}"

    def _check_offered(self) -> None:
        """Raises StalledError: a node that answers every frame has had one for long, and nobody offers an answer."""
        if self._offered or self._first_frame_at is None or self._file.answers is Answers.SPARSE:
            return
        if time.monotonic() - self._first_frame_at >= self._file.patience:
            if missing := self._missing_answer(self._view()):
                raise StalledError(f"{missing}{self._warned()}")
            self._offered = True

    def _unused(self, view: View) -> Iterator[str]:
        """Topics with nobody on one side, and what else both kinds of ROS can tell, a sentence each."""
        if missing := self._missing_answer(view):
            yield missing
        if not view.readers.get(CLOCK):
            yield "nobody reads /clock: the node goes by the wall's clock, and its answers by the machine's speed"
        for topic in view.readers:
            if not view.publishers.get(topic) and topic not in (*self._topics, *ALWAYS):
                yield f"the node reads {topic}, which nobody publishes.{did_you_mean(topic, self._topics)}"
        for topic in self._topics:
            if not view.readers.get(topic):
                yield f"nobody reads {topic}.{did_you_mean(topic, view.readers)}"

    def _told_frames(self) -> set[str]:
        encoder = self._encoder
        names = {encoder.frame(name) for name in ("base_footprint", "odom", *encoder.mounted)}
        return names | {self._file.answer.world, encoder.frame("map")} - {""}

    def _frames(self) -> Iterable[str]:
        return unknown_frames(self._file.parameters, self._told_frames())


def _and(names: Iterable[str]) -> str:
    return " and ".join(sorted(names))
