"""`Transport` over ROS 1: a node of our own, under a master of our own or that of a user."""

from __future__ import annotations

import os
import queue
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

from taskslam.errors import InputError
from taskslam.ros.errors import RosError
from taskslam.ros.ros1.master import Master
from taskslam.ros.ros1.node import Node, Publication, SlowSubscriberError, long, short
from taskslam.ros.ros1.xmlrpc import HERE
from taskslam.ros.transport import Heard, SlowReaderError, Transport


class Ros1(Transport):
    """A node `name` (as /taskslam). master: the URI of one that runs already, or None for one of our own.

    Where peers find this machine is ROS_IP, as for any node; by default only those on this machine do.
    Raises InputError: no master answers there.
    """

    def __init__(self, name: str, master: str | None) -> None:
        self._master = None if master else Master()
        self._uri = master or (self._master.uri if self._master else "")
        self.variables = {"ROS_MASTER_URI": self._uri}
        self._node = Node(name, self._uri, host=os.environ.get("ROS_IP", HERE))
        self.store, self.complaints = self._node.store, self._node.complaints
        self._publications: dict[str, Publication] = {}
        self._kinds: dict[str, str] = {}
        self._inbox: queue.SimpleQueue[tuple[str, str, bytearray]] = queue.SimpleQueue()
        try:
            self._node.ask("getUri")
        except RosError:
            self.close()
            raise InputError(
                f"no ROS master answers at {self._uri}; expected that of a running roscore (ROS_MASTER_URI)"
            ) from None

    def advertise(self, topic: str, kind: str, latched: bool = False) -> None:
        """A topic to publish on. Raises InputError: the master is gone."""
        with self._asking():
            self._publications[topic] = self._node.advertise(topic, short(kind), latched)

    def publish(self, topic: str, message: Any) -> None:
        """To everybody who reads the topic. Raises SlowReaderError."""
        try:
            self._publications[topic].publish(message)
        except SlowSubscriberError as error:
            raise SlowReaderError(str(error)) from None

    def readers(self, topic: str) -> int:
        """How many are connected to a topic that we publish."""
        return len(self._publications[topic].peers)

    def subscribe(self, topic: str, kind: str, latched: bool = False) -> None:  # noqa: ARG002 its publisher latches
        """Hear a topic from now on. Raises InputError: the master is gone."""
        self._kinds[topic] = short(kind)
        with self._asking():
            self._node.subscribe(topic, short(kind), partial(self._take, topic))

    def writers(self, topic: str) -> int:
        """How many we are connected to on a topic that we hear."""
        return self._node.publishers_of(topic)

    def hear(self, longest_s: float) -> Sequence[Heard]:
        """What was said since the last time."""
        said: list[tuple[str, str, bytearray]] = []
        with suppress(queue.Empty):
            said.append(self._inbox.get(timeout=longest_s))
            while True:
                said.append(self._inbox.get_nowait())
        heard = []
        for topic, by, data in said:
            try:
                heard.append(Heard(topic, by, self._node.decode(self._kinds[topic], data)))
            except RosError as error:
                if (words := f"{topic}: {by} says what is {error}") not in self.complaints:
                    self.complaints.append(words)
        return heard

    def published(self) -> Mapping[str, str]:
        """The topics that anybody publishes, with their types. Raises InputError: the master is gone."""
        with self._asking():
            publishers, _, _ = self._node.ask("getSystemState")
            types = dict(self._node.ask("getTopicTypes"))
        return {topic: long(types[topic]) for topic, _ in publishers if topic in types}

    def last_words(self, topic: str, message: Any) -> None:
        """Nothing: nobody is left who could say it."""

    def close(self) -> None:
        """Leave, and end our own master."""
        self._node.close()
        if self._master is not None:
            self._master.close()

    @contextmanager
    def _asking(self) -> Iterator[None]:
        try:
            yield
        except (RosError, ValueError, TypeError) as error:
            raise InputError(f"the ROS master at {self._uri} does not answer any more: {error}") from None

    def _take(self, topic: str, by: str, data: bytearray) -> None:
        self._inbox.put((topic, by, data))
