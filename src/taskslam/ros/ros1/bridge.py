"""Between the rules of lockstep and a ROS 1 node: a master and a node of our own, and the foreign process."""

from __future__ import annotations

import queue
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from taskslam.errors import InputError, did_you_mean
from taskslam.geometry import FloatArray
from taskslam.measurements import NANOSECONDS, Measurement, WheelOdometry
from taskslam.robot import SensorRig
from taskslam.ros.encoding import NodeEncoder, Odometer, PoseReader, Utterance, unknown_frames
from taskslam.ros.lockstep import Answer, Lockstep
from taskslam.ros.node_file import NodeFile
from taskslam.ros.process import NodeProcess, processor_time
from taskslam.ros.ros1.master import Master
from taskslam.ros.ros1.node import Node, SlowSubscriberError, short
from taskslam.ros.ros1.xmlrpc import HERE, RosError, call
from taskslam.sensors import sensor_kind
from taskslam.slam.base import InvalidOutputError, StalledError

_US = "/taskslam"
_TF, _TF_STATIC, _CLOCK, _ROSOUT = "/tf", "/tf_static", "/clock", "/rosout"
_TF_TYPE, _CLOCK_TYPE, _LOG_TYPE = "tf2_msgs/TFMessage", "rosgraph_msgs/Clock", "rosgraph_msgs/Log"
_LOOK_EVERY_S = 0.02
_SETTLED_S = 0.25  # without a new registration, a node has said all that it publishes and subscribes
WAITING_FROM = -600 * NANOSECONDS  # where the clock begins while a node gets ready
_WARN = 4  # rosgraph_msgs/Log
_MOST_WARNINGS = 5
_ONE_ALONE = "expected one of them alone"


class NodeEndedError(Exception):
    """The node's process has ended."""


class Bridge:
    """One life of a node: a `Wire` for `Lockstep`. Open with `shake_hands`, and `close` in any case.

    Raises InputError: the node cannot be started, or its file does not fit the robot.
    """

    def __init__(self, node: NodeFile, rig: SensorRig) -> None:
        self._file = node
        self.warnings: list[str] = []
        self.odometer = Odometer()
        self._inbox: queue.SimpleQueue[tuple[str, bytearray]] = queue.SimpleQueue()
        self._speakers: set[str] = set()
        self._transformed = -1
        self._processes: set[int] = set()
        self._given: list[str] = []  # whole names of the parameters that the file sets
        self._master = Master()
        self._us = Node(_US, self._master.uri, node.patience)
        self._process: NodeProcess | None = None
        try:
            self._encoder = NodeEncoder(self._us.store, rig, node.frames, node.clouds_from)
            self._reader = PoseReader(node.answer, self._encoder, self.odometer)
            self._set_parameters()
            self._open_topics()
            self._process = self._started()
        except BaseException:
            self.close()
            raise

    def shake_hands(self, lockstep: Lockstep) -> None:
        """Wait until the node is connected, the clock going on meanwhile; then reset it, where a service does that.

        Raises InputError: it is not within its time, it ended, or two nodes say the same.
        """
        deadline = time.monotonic() + self._file.start
        seen, since = self._master.graph(), time.monotonic()
        while True:
            now = time.monotonic()
            graph = self._master.graph()
            if graph != seen:
                seen, since = graph, now
            if not self._node.alive:
                raise InputError(f"{self._node.ending()}{self._warned()}, before it was connected")
            unready = list(self._unready())
            if not unready and now - since >= _SETTLED_S:
                break
            if now > deadline:
                raise InputError("; ".join([*unready, *self._us.complaints]) + self._warned())
            lockstep.tick(below=0)
            time.sleep(_LOOK_EVERY_S)
        if doubles := list(self._doubles()):
            raise InputError("; ".join(doubles))
        for name, api in self._master.graph().nodes.items():
            if name != _US:
                with suppress(RosError):
                    self._processes.add(call(api, "getPid", _US))
        if self._file.reset != "restart":
            try:
                self._us.call_service(self._file.reset)
            except RosError as error:
                raise InputError(f"reset by the service {self._file.reset}: {error}") from error

    def utterance(self, measurement: Measurement) -> Utterance:
        """A measurement as the node will be told it."""
        if isinstance(measurement, WheelOdometry):
            self.odometer.newest = measurement
        return self._encoder.utterance(measurement)

    def transforms(self, until: int) -> None:
        """The base in `odom` at that instant, once."""
        if until > self._transformed and (at := self.odometer.at(until)) is not None:
            self._transformed = until
            self._publish(_TF, self._encoder.base_in_odom(until, at))

    def clock(self, now: int) -> None:
        """/clock."""
        self._publish(_CLOCK, self._encoder.new("rosgraph_msgs/msg/Clock", clock=self._encoder.time(now)))

    def say(self, saying: Utterance) -> None:
        """All messages of a measurement."""
        for topic, message in saying.messages:
            self._publish(topic, message)

    def hear(self, longest_s: float) -> Sequence[Answer]:
        """Poses that the node has said. Raises NodeEndedError, and InvalidOutputError: it says what is no pose."""
        try:
            heard = [self._inbox.get(timeout=longest_s)]
        except queue.Empty:
            if not self._node.alive:
                raise NodeEndedError(f"{self._node.ending()}{self._warned()}") from None
            return ()
        with suppress(queue.Empty):
            while True:
                heard.append(self._inbox.get_nowait())
        self._speakers.update(name for name, _ in heard)
        if self._file.answer.topic and len(self._speakers) > 1:
            raise InvalidOutputError(f"poses of {_and(self._speakers)}; {_ONE_ALONE}")
        return [answer for _, data in heard if (answer := self._answer(data)) is not None]

    def worked(self) -> float:
        """Processor time of the node and of all that registered with the master, s."""
        return self.processor_time() / NANOSECONDS

    def processor_time(self) -> int:
        """The same in ns."""
        return processor_time(self._processes)

    def findings(self) -> Iterator[str]:
        """What may be wrong with the node file, or with the node, though it answers: a sentence each."""
        graph = self._master.graph()
        if not graph.subscribers.get(_CLOCK):
            yield "nobody reads /clock: the node goes by the wall's clock, and its answers by the machine's speed"
        own = [topic for topic in graph.subscribers if set(graph.subscribers[topic]) - {_US}]
        for topic in own:
            if not graph.publishers.get(topic):
                yield f"the node reads {topic}, which nobody publishes.{did_you_mean(topic, self._topics)}"
        for topic in self._topics:
            if not set(graph.subscribers.get(topic, ())) - {_US} and topic not in (_CLOCK, _TF, _TF_STATIC):
                yield f"nobody reads {topic}.{did_you_mean(topic, own)}"
        asked = self._master.asked()
        for name in self._given:
            if not any(_within(name, one) or _within(one, name) for one in asked):
                unset = [one for one in asked if not self._master.parameters.has(one)]
                yield f"no node asked for the parameter {name}.{did_you_mean(name, unset)}"
        yield from unknown_frames(self._file.parameters, self._told_frames())
        yield from self._us.complaints
        yield from self.warnings

    def close(self) -> None:
        """End the node, the connections and the master. Idempotent."""
        if self._process is not None:
            self._process.end()
        self._us.close()
        self._master.close()

    @property
    def _node(self) -> NodeProcess:
        assert self._process is not None
        return self._process

    @property
    def _space(self) -> str:
        return f"/{self._file.name}/"

    def _set_parameters(self) -> None:
        file = self._file
        self._master.parameters.set("/use_sim_time", True)
        given: dict[str, Any] = {name: self._beside(value) for name, value in file.parameters.items()}
        given |= {name: self._encoder.extrinsic(wanted) for name, wanted in file.extrinsics.items()}
        given |= {name: self._encoder.intrinsic(wanted) for name, wanted in file.intrinsics.items()}
        for name, value in given.items():
            whole = name if name.startswith("/") else self._space + name
            self._given.append(whole)
            self._master.parameters.set(whole, value)

    def _beside(self, value: Any) -> Any:
        match value:
            case str():
                return self._file.beside(value)
            case list():
                return [self._beside(part) for part in value]
            case dict():
                return {key: self._beside(part) for key, part in value.items()}
        return value

    def _open_topics(self) -> None:
        file = self._file
        kinds = [sensor_kind(sensor) for sensor in file.sensors]
        ours = {topic.name: short(topic.kind) for kind in kinds for topic in kind.topics}
        self._topics = {file.topics.get(topic, topic): kind for topic, kind in ours.items()}
        self._published = {
            topic: self._us.advertise(file.topics.get(topic, topic), kind) for topic, kind in ours.items()
        }
        self._awaited = [
            file.topics.get(topic.name, topic.name) for topic in sensor_kind(file.awaited).topics if topic.role
        ]
        for topic, kind, latch in ((_TF, _TF_TYPE, False), (_TF_STATIC, _TF_TYPE, True), (_CLOCK, _CLOCK_TYPE, False)):
            self._published[topic] = self._us.advertise(topic, kind, latch)
        mounts: list[tuple[str, FloatArray]] = list(self._encoder.mounted.items())
        self._publish(_TF_STATIC, self._encoder.mounts(WAITING_FROM, mounts))
        self._us.subscribe(_ROSOUT, _LOG_TYPE, self._log)
        self._us.subscribe(self._answers_on, self._answers_as, self._hear)

    @property
    def _answers_on(self) -> str:
        return self._file.answer.topic or _TF

    @property
    def _answers_as(self) -> str:
        return self._file.answer.type or _TF_TYPE

    def _started(self) -> NodeProcess:
        file = self._file
        remaps = [f"{from_}:={to}" for from_, to in file.remaps.items()]
        variables = {
            "ROS_LOG_DIR": str(Path.cwd() / "log"),
            "ROS_HOME": str(Path.cwd()),
            "PYTHONUNBUFFERED": "1",
            **file.environment,
            "ROS_MASTER_URI": self._master.uri,
            "ROS_IP": HERE,
        }
        setup = file.beside(file.setup) if file.setup else None
        process = NodeProcess([*file.arguments, *remaps, f"__name:={file.name}"], setup, variables)
        self._processes.add(process.pid)
        return process

    def _publish(self, topic: str, message: Any) -> None:
        try:
            self._published[topic].publish(message)
        except SlowSubscriberError as error:
            raise StalledError(f"{error}{self._warned()}") from error

    def _hear(self, publisher: str, data: bytearray) -> None:
        if publisher != _US:
            self._inbox.put((publisher, data))

    def _answer(self, data: bytearray) -> Answer | None:
        try:
            return self._reader.read(self._us.decode(self._answers_as, data))
        except RosError as error:
            raise InvalidOutputError(f"on {self._answers_on} what is {error}") from error

    def _log(self, publisher: str, data: bytearray) -> None:
        with suppress(RosError):
            said = self._us.decode(_LOG_TYPE, data)
            words = f'{publisher} warns: "{" ".join(str(said.msg).split())[:200]}"'
            if publisher != _US and said.level >= _WARN and words not in self.warnings:
                self.warnings = [*self.warnings, words][-_MOST_WARNINGS:]

    def _warned(self) -> str:
        return "".join(f"; {words}" for words in self.warnings[-2:])

    def _unready(self) -> Iterator[str]:
        """What is missing before the first measurement can be said, a sentence each."""
        graph = self._master.graph()
        theirs = [topic for topic, nodes in graph.subscribers.items() if set(nodes) - {_US}]
        for topic in self._awaited:
            if not set(graph.subscribers.get(topic, ())) - {_US}:
                others = [other for other in theirs if not other.startswith(("/tf", "/clock"))]
                reads = f"the node reads {', '.join(sorted(others))}" if others else "the node reads no topic"
                yield f"nobody reads {topic}: {reads}.{did_you_mean(topic, others)}"
        for publication in self._published.values():
            for name in graph.subscribers.get(publication.topic, {}):
                if name != _US and name not in publication.peers:
                    yield f"{name} has not connected to {publication.topic} yet"
        yield from self._unanswered()

    def _unanswered(self) -> Iterator[str]:
        graph, topic, kind = self._master.graph(), self._answers_on, self._answers_as
        if set(graph.publishers.get(topic, ())) - {_US}:
            if graph.types.get(topic) != kind:
                yield f"{topic} is of the type {graph.types.get(topic)}; expected {kind}"
            elif not self._us.publishers_of(topic):
                yield f"the publisher of {topic} has not answered yet"
            return
        others = [other for other, nodes in graph.publishers.items() if set(nodes) - {_US} and other != _ROSOUT]
        says = f"the node publishes {', '.join(sorted(others))}" if others else "the node publishes nothing"
        yield f"nobody publishes {topic}: {says}.{did_you_mean(topic, others)}"

    def _doubles(self) -> Iterator[str]:
        """Topics that two nodes publish where there can be one, a sentence each."""
        publishers = self._master.graph().publishers
        for topic in (self._answers_on, *(held.topic for held in self._published.values())):
            names = [name for name in publishers.get(topic, ()) if topic != self._answers_on or name != _US]
            if len(names) > 1 and topic not in (_TF, _TF_STATIC):
                yield f"{_and(names)} both publish {topic}; {_ONE_ALONE}"

    def _told_frames(self) -> set[str]:
        encoder = self._encoder
        names = {encoder.frame(name) for name in ("base_footprint", "odom", *encoder.mounted)}
        return names | {self._file.answer.world, encoder.frame("map")} - {""}


def _within(name: str, folder: str) -> bool:
    """Whether a parameter is the other, or stands in it."""
    return f"{name}/".startswith(f"{folder.rstrip('/')}/")


def _and(names: Iterable[str]) -> str:
    return " and ".join(sorted(names))
