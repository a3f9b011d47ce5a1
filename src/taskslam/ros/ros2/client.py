"""ROS 2 as we use it: a bridge process of the user's interpreter, asked and heard over pipes.

Messages of topics are encoded here, by the standard definitions of the distribution that the bridge has, and it needs
no more than their types' names. Requests, goals and answers are plain values; what a distribution lacks is not there.
"""

from __future__ import annotations

import fcntl
import itertools
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as NotYetError
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, cast

from rosbags.typesys import Stores

from taskslam.datasets.bag_access import ros_types
from taskslam.errors import InputError
from taskslam.ros.errors import RejectedError, RosError
from taskslam.ros.process import program
from taskslam.ros.qos import Quality
from taskslam.ros.ros2 import bridge_process as protocol

_BRIDGE = Path(protocol.__file__)
_START_S = 30.0
_ANSWER_S = 10.0
_END_S = 4.0  # goals are canceled meanwhile
_PIPE_SIZE = 1 << 20
_STORES = {"humble": Stores.ROS2_HUMBLE, "iron": Stores.ROS2_IRON, "jazzy": Stores.ROS2_JAZZY}
_DEFAULT_STORE = Stores.ROS2_KILTED

Values = dict[str, Any]
"""A message as plain values, by its fields' names."""


@dataclass(frozen=True, slots=True)
class End:
    """A node's end of a topic: who, with which type (as std_msgs/msg/String) and quality."""

    node: str
    type: str
    quality: Quality


@dataclass(frozen=True, slots=True)
class Graph:
    """Who is there, and does what: ends by topic; services' types by name. What we do ourselves is in it too."""

    nodes: tuple[str, ...]
    publishers: Mapping[str, tuple[End, ...]]
    subscribers: Mapping[str, tuple[End, ...]]
    services: Mapping[str, tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class Result:
    """How a goal of an action ended, and what was told with it.

    status: succeeded, aborted, canceled, gone (its server) or unknown.
    """

    status: str
    values: Values


@dataclass(slots=True)
class Goal:
    """A goal that was accepted. Wait for `result` with its own timeout."""

    number: int
    result: Future[Result] = field(default_factory=Future)


class Ros2:
    """A node of our own, of that name. setup: a script whose `python3` has rclpy; without it, our own interpreter.

    variables: for the bridge, such as its domain. facts: what it says of itself. Raises InputError: there is no bridge
    to be had so, in words.
    """

    def __init__(self, name: str, setup: str | None, variables: Mapping[str, str]) -> None:
        python = "python3" if setup else sys.executable
        words, environment = program([python, str(_BRIDGE), name], setup, variables, ours=not setup)
        try:
            self._process = subprocess.Popen(  # noqa: S603
                words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment, start_new_session=True
            )
        except OSError as error:
            raise InputError(f"the bridge to ROS 2 cannot be started: {error}") from error
        self._input, self._output = cast(BinaryIO, self._process.stdin), cast(BinaryIO, self._process.stdout)
        for pipe in (self._input, self._output):
            with suppress(OSError):  # a user's pipe budget may be used up: smaller pipes work too
                fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, _PIPE_SIZE)
        self._speaking, self._numbers = threading.Lock(), itertools.count(1)
        self._asked: dict[int, Future[Any]] = {}
        self._heard: dict[int, Callable[[bytes], None]] = {}
        self._goals: dict[int, tuple[Goal, Callable[[Values], None]]] = {}
        self._ready: Future[Values] = Future()
        self._teller = ThreadPoolExecutor(1, "tells of goals")
        self.complaints: list[str] = []
        self._ended = False
        threading.Thread(target=self._read, name="hears the bridge", daemon=True).start()
        try:
            self.facts = self._ready.result(_START_S)
        except BaseException as error:
            self.close()
            if isinstance(error, RosError):
                hint = "" if setup else "; pip install 'taskslam[ros2]', or name the setup script of a ROS 2"
                raise InputError(f"no bridge to ROS 2: {error}{hint}") from error
            if isinstance(error, NotYetError):
                raise InputError(f"the bridge to ROS 2 was not ready within {_START_S:g} s") from error
            raise
        self.name: str = self.facts["node"]
        self.store = ros_types(_STORES.get(self.facts["distribution"], _DEFAULT_STORE))

    @property
    def alive(self) -> bool:
        """Whether the bridge has not ended."""
        return not self._ended

    def advertise(self, topic: str, kind: str, quality: Quality) -> Publication:
        """A topic to publish on. kind: as sensor_msgs/msg/LaserScan. Raises RosError: the bridge's ROS has none."""
        number = next(self._numbers)
        self._ask("advertise", id=number, topic=topic, type=kind, qos=quality.model_dump())
        return Publication(self, number, topic, kind, quality)

    def subscribe(self, topic: str, kind: str, quality: Quality, heard: Callable[[bytes], None]) -> int:
        """Have `heard` told of every message, in CDR, in the thread that reads them. Returns what `withdraw` takes."""
        number = next(self._numbers)
        self._heard[number] = heard
        self._ask("subscribe", id=number, topic=topic, type=kind, qos=quality.model_dump())
        return number

    def withdraw(self, number: int) -> None:
        """End a publication (its `number`) or a subscription."""
        self._ask("withdraw", id=number)
        self._heard.pop(number, None)

    def matched(self, number: int) -> int:
        """How many peers a publication or a subscription is connected to."""
        return int(self._ask("matched", id=number))

    def decode(self, kind: str, data: bytes | bytearray) -> Any:
        """The message of some bytes. Raises RosError: they are no such message."""
        try:
            return self.store.deserialize_cdr(memoryview(data), kind)
        except Exception as error:  # of many kinds, on damaged bytes
            raise RosError(f"not a {kind}: {error}") from error

    def graph(self) -> Graph:
        """Who is there, as far as it is known here."""
        told = self._ask("graph")
        topics = told["topics"]
        publishers, subscribers = (
            {topic: tuple(map(_end, content[role])) for topic, content in topics.items() if content[role]}
            for role in ("publishers", "subscribers")
        )
        services = {name: tuple(types) for name, types in told["services"].items()}
        return Graph(tuple(told["nodes"]), publishers, subscribers, services)

    def call(self, service: str, kind: str, fields: Values | None = None, within_s: float = _ANSWER_S) -> Values:
        """What a service answers. kind: as std_srvs/srv/Trigger. Raises RosError: nobody does, or not in time."""
        asked = {"service": service, "type": kind, "fields": fields or {}, "within_s": within_s}
        answer: Values = self._ask("call", within_s * 2 + _ANSWER_S, **asked)
        return answer

    def send_goal(
        self,
        action: str,
        kind: str,
        fields: Values,
        feedback: Callable[[Values], None] = lambda _: None,
        within_s: float = _ANSWER_S,
    ) -> Goal:
        """Send a goal to an action. kind: as nav2_msgs/action/NavigateToPose. feedback: told in a thread of its own.

        Raises RosError: nobody offers the action; RejectedError: it is not accepted.
        """
        goal = Goal(next(self._numbers))
        self._goals[goal.number] = goal, feedback
        asked = {"action": action, "type": kind, "fields": fields, "within_s": within_s}
        try:
            if not self._ask("send_goal", within_s * 2 + _ANSWER_S, id=goal.number, **asked):
                raise RejectedError(f"{action} does not accept it")
        except BaseException:
            self._goals.pop(goal.number, None)
            raise
        return goal

    def cancel(self, goal: Goal) -> bool:
        """Ask for a goal to be canceled; whether it is going to be. How it ended is told by its result."""
        return bool(self._ask("cancel", id=goal.number))

    def last_words(self, number: int, data: bytes | memoryview) -> None:
        """A message (CDR) that the bridge publishes on a publication of ours when it ends, also if we are killed."""
        self._say({"do": "last_words", "id": number}, data)

    def close(self) -> None:
        """End the bridge; it cancels what goals are open. Idempotent."""
        with suppress(OSError), self._speaking:
            self._input.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_END_S)
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._teller.shutdown(wait=False)

    def _say(self, header: Values, body: bytes | memoryview = b"") -> None:
        begin, rest = protocol.frame(header, body)
        try:
            with self._speaking:
                self._input.write(begin)
                self._input.write(rest)
                self._input.flush()
        except (OSError, ValueError) as error:
            raise RosError("the bridge to ROS 2 has ended") from error

    def _ask(self, what: str, longest_s: float = _ANSWER_S, **words: Any) -> Any:
        number, answer = next(self._numbers), Future[Any]()
        self._asked[number] = answer
        try:
            self._say({"ask": number, "do": what, **words})
            if self._ended:
                raise RosError("the bridge to ROS 2 has ended")
            return answer.result(longest_s)
        except NotYetError as error:
            raise RosError(f"the bridge to ROS 2 has not answered '{what}' within {longest_s:g} s") from error
        finally:
            self._asked.pop(number, None)

    def _read(self) -> None:
        why = "the bridge to ROS 2 has ended"
        try:
            while (said := protocol.read_frame(self._output)) is not None:
                self._take(*said)
        except Exception as error:  # whatever is wrong with it, nothing more can be read
            why = f"the bridge to ROS 2 said what is no frame: {error}"
        self._ended = True
        gone = RosError(why)
        open_goals = [goal.result for goal, _ in self._goals.values()]
        for waiting in (self._ready, *list(self._asked.values()), *open_goals):
            if not waiting.done():
                waiting.set_exception(gone)

    def _take(self, header: Values, body: bytes) -> None:
        match header:
            case {"heard": number}:
                if heard := self._heard.get(number):
                    heard(body)
            case {"answer": number, "error": words}:
                if asked := self._asked.get(number):
                    asked.set_exception(RosError(words))
            case {"answer": number, "value": value}:
                if asked := self._asked.get(number):
                    asked.set_result(value)
            case {"feedback": number, "value": value}:
                if number in self._goals:
                    self._teller.submit(self._goals[number][1], value)
            case {"result": number, "status": status, "value": value}:
                if number in self._goals:
                    goal, _ = self._goals.pop(number)
                    goal.result.set_result(Result(status, value or {}))
            case {"ready": facts}:
                self._ready.set_result(facts)
            case {"unable": why}:
                self._ready.set_exception(RosError(why))
            case {"error": words}:
                self.complaints.append(words)


class Publication:
    """A topic that we publish. number: what `withdraw` and `matched` take; kind: its type."""

    def __init__(self, ros: Ros2, number: int, topic: str, kind: str, quality: Quality) -> None:
        self.number, self.topic, self.kind, self.quality = number, topic, kind, quality
        self._ros = ros

    def publish(self, message: Any) -> None:
        """A message of our typestore. Raises RosError: the bridge is gone."""
        self._ros._say({"do": "publish", "id": self.number}, self._ros.store.serialize_cdr(message, self.kind))


def _end(told: Values) -> End:
    reliability, durability = told["reliability"], told["durability"]
    quality = Quality(
        reliability="best_effort" if reliability == "best_effort" else "reliable",
        durability="transient_local" if durability == "transient_local" else "volatile",
    )
    return End(told["node"], told["type"], quality)
