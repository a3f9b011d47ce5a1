"""A ROS 1 node of our own: publishes, subscribes and calls services, under any master.

Messages are those of a rosbags typestore. Publishing returns once every subscriber's socket has taken all
bytes: nothing is ever dropped on this side, and a subscriber that reads nothing is named.
"""

from __future__ import annotations

import os
import socket
import struct
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit

from rosbags.typesys import Stores
from rosbags.typesys.store import Typestore

from taskslam.datasets.bag_access import ros_types
from taskslam.ros.errors import RosError
from taskslam.ros.ros1 import tcpros
from taskslam.ros.ros1.xmlrpc import HERE, Server, call

_PATIENCE_S = 10.0
_SEQUENCE = struct.Struct("<I")
Heard = Callable[[str, bytearray], None]
"""Told the publisher's name and the message's bytes, in the thread that reads them."""


class SlowSubscriberError(RosError):
    """A subscriber has read nothing for long, and its queue is full."""


class Publication:
    """A topic that we publish. kind: its type as ROS 1 writes it; peers: connected subscribers by name.

    Messages that begin with a header are numbered from 0, as roscpp numbers them: some nodes go by that.
    """

    def __init__(self, topic: str, kind: str, store: Typestore, latch: bool, patience_s: float) -> None:
        self.topic, self.kind = topic, kind
        self._name = long(kind)
        self.definition, self.md5 = store.generate_msgdef(self._name, ros_version=1)
        self._store, self._patience_s = store, patience_s
        self._latched: bytes | None = None
        self._latch = latch
        self._numbered = next(iter(store.fielddefs[self._name][1]), ("",))[0] == "header"
        self._count = 0
        self._connections: dict[socket.socket, str] = {}
        self._lock = threading.Lock()

    @property
    def peers(self) -> list[str]:
        """Connected subscribers by name."""
        with self._lock:
            return list(self._connections.values())

    def publish(self, message: Any) -> None:
        """To all subscribers, and to later ones too if it is latched.

        Raises SlowSubscriberError: one of them has read nothing for so long that no more fits. All others were sent
        the message, and it is left: half a message was the last that it could have read.
        """
        content = bytes(self._store.serialize_ros1(message, self._name))
        slow: list[str] = []
        with self._lock:
            if self._numbered:
                content = _SEQUENCE.pack(self._count & 0xFFFFFFFF) + content[_SEQUENCE.size :]
                self._count += 1
            data = tcpros.framed(content)
            if self._latch:
                self._latched = data
            for connection, name in list(self._connections.items()):
                try:
                    connection.sendall(data)
                except TimeoutError:
                    slow.append(name)
                    self._drop(connection)
                except OSError:
                    self._drop(connection)
        if slow:
            who = " and ".join(slow)
            raise SlowSubscriberError(
                f"{self.topic}: {who} has read nothing for {self._patience_s:g} s, and its queue is full"
            )

    def accept(self, connection: socket.socket, header: tcpros.Header, ours: Mapping[str, str]) -> None:
        """Take a subscriber, or tell it why not."""
        if wrong := tcpros.differences(header, self.kind, self.md5):
            tcpros.send(connection, tcpros.packed({"error": f"{self.topic}: {wrong}"}))
            connection.close()
            return
        facts = {"md5sum": self.md5, "type": self.kind, "topic": self.topic, "latching": str(int(self._latch))}
        connection.settimeout(self._patience_s)
        with self._lock:
            tcpros.send(connection, tcpros.packed({**ours, **facts, "message_definition": self.definition}))
            if self._latched is not None:
                tcpros.send(connection, self._latched)
            self._connections[connection] = header.get("callerid", "?")

    def close(self) -> None:
        """Leave all subscribers."""
        with self._lock:
            for connection in list(self._connections):
                self._drop(connection)

    def _drop(self, connection: socket.socket) -> None:
        self._connections.pop(connection, None)
        connection.close()


class Node:
    """A node. name: whole, as /taskslam; master: its URI. complaints: why peers were refused, or refused us.

    host: this machine's address, by which peers find the node; by default only those on this machine do.
    """

    def __init__(self, name: str, master: str, patience_s: float = _PATIENCE_S, host: str = HERE) -> None:
        self.name, self._master, self._patience_s, self._host = name, master, patience_s, host
        self.store = ros_types(Stores.ROS1_NOETIC)
        self.complaints: list[str] = []
        self._publications: dict[str, Publication] = {}
        self._subscriptions: dict[str, tuple[str, str, Heard]] = {}
        self._links: dict[tuple[str, str], socket.socket | None] = {}
        self._lock = threading.Lock()
        self._closed = False
        self._listener = socket.create_server((host, 0))
        self._server = Server(self, host)
        threading.Thread(target=self._accept, name="tcpros", daemon=True).start()

    def functions(self) -> Mapping[str, Any]:
        """The slave API, as far as peers use it."""
        return {
            "requestTopic": self._request_topic,
            "publisherUpdate": self._publisher_update,
            "paramUpdate": lambda _caller, _name, _value: 0,
            "getPid": lambda _caller: os.getpid(),
            "getMasterUri": lambda _caller: self._master,
            "getBusInfo": lambda _caller: [],
            "getBusStats": lambda _caller: [[], [], []],
            "getSubscriptions": lambda _caller: [[topic, kind] for topic, (kind, *_) in self._subscriptions.items()],
            "getPublications": lambda _caller: [[topic, held.kind] for topic, held in self._publications.items()],
            "shutdown": lambda _caller, *_words: 0,
        }

    def advertise(self, topic: str, kind: str, latch: bool = False) -> Publication:
        """A topic to publish on. kind: as `sensor_msgs/LaserScan`."""
        publication = Publication(topic, kind, self.store, latch, self._patience_s)
        self._publications[topic] = publication
        self.ask("registerPublisher", topic, kind, self._server.uri)
        return publication

    def subscribe(self, topic: str, kind: str, heard: Heard) -> None:
        """Have `heard` told of every message."""
        md5 = self.store.generate_msgdef(long(kind), ros_version=1)[1]
        self._subscriptions[topic] = kind, md5, heard
        self._publisher_update(self.name, topic, self.ask("registerSubscriber", topic, kind, self._server.uri))

    def publishers_of(self, topic: str) -> int:
        """How many publishers of a topic we are connected to."""
        with self._lock:
            return sum(at == topic and link is not None for (at, _), link in self._links.items())

    def decode(self, kind: str, data: bytes | bytearray) -> Any:
        """The message of some bytes. Raises RosError: they are no such message."""
        try:
            return self.store.deserialize_ros1(memoryview(data), long(kind))
        except Exception as error:  # of many kinds, on damaged bytes
            raise RosError(f"not a {kind}: {error}") from error

    def call_service(self, service: str, request: bytes = b"") -> bytes:
        """What a service answers to the bytes of a request. Raises RosError: there is none, or it refuses."""
        address = urlsplit(self.ask("lookupService", service))
        header = {"callerid": self.name, "service": service, "md5sum": tcpros.ANY, "persistent": "0"}
        connection, _ = tcpros.connect(address.hostname or "", address.port or 0, header)
        with connection:
            connection.settimeout(self._patience_s)
            tcpros.send(connection, tcpros.framed(request))
            accepted = tcpros.receive(connection, 1) == b"\x01"
            answer = tcpros.receive_message(connection)
        if not accepted:
            raise RosError(f"{service} refuses: {answer.decode(errors='replace')}")
        return bytes(answer)

    def ask(self, function: str, *arguments: Any) -> Any:
        """Ask the master. Raises RosError."""
        return call(self._master, function, self.name, *arguments)

    def close(self) -> None:
        """Leave: the master is told, connections end."""
        if self._closed:
            return
        self._closed = True
        for function, topics in (
            ("unregisterPublisher", self._publications),
            ("unregisterSubscriber", self._subscriptions),
        ):
            for topic in topics:
                with suppress(RosError):
                    self.ask(function, topic, self._server.uri)
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._server.close()
        for publication in self._publications.values():
            publication.close()
        with self._lock:
            for link in self._links.values():
                if link is not None:
                    with suppress(OSError):
                        link.shutdown(socket.SHUT_RDWR)

    def _request_topic(self, caller: str, topic: str, protocols: list[list[Any]]) -> list[Any]:
        if topic not in self._publications:
            raise RosError(f"{self.name} does not publish {topic}")
        if not any(protocol[:1] == ["TCPROS"] for protocol in protocols):
            raise RosError(f"{self.name} speaks TCPROS, {caller} does not")
        return ["TCPROS", self._host, self._listener.getsockname()[1]]

    def _publisher_update(self, caller: str, topic: str, publishers: list[str]) -> int:  # noqa: ARG002
        with self._lock:
            new = [(topic, uri) for uri in publishers if (topic, uri) not in self._links]
            self._links |= dict.fromkeys(new)
            for gone in [key for key in self._links if key[0] == topic and key[1] not in publishers]:
                self._links.pop(gone)
        for _, uri in new:
            threading.Thread(target=self._read, args=(topic, uri), name=f"reads {topic}", daemon=True).start()
        return 0

    def _read(self, topic: str, uri: str) -> None:
        kind, md5, heard = self._subscriptions[topic]
        try:
            _, host, port = call(uri, "requestTopic", self.name, topic, [["TCPROS"]])
            header = {"callerid": self.name, "topic": topic, "type": kind, "md5sum": md5, "tcp_nodelay": "1"}
            link, theirs = tcpros.connect(host, port, header)
        except (RosError, ValueError, TypeError) as error:
            self._complain(f"{topic}: {error}")
            return
        with link:
            if wrong := tcpros.differences(theirs, kind, md5):
                self._complain(f"{topic}: {wrong}")
                return
            with self._lock:
                self._links[topic, uri] = link
            with suppress(RosError):
                while True:
                    heard(theirs.get("callerid", "?"), tcpros.receive_message(link))
            with self._lock:
                self._links.pop((topic, uri), None)

    def _accept(self) -> None:
        while not self._closed:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            threading.Thread(target=self._welcome, args=(connection,), name="shakes hands", daemon=True).start()

    def _welcome(self, connection: socket.socket) -> None:
        try:
            connection.settimeout(self._patience_s)
            tcpros.at_once(connection)
            header = tcpros.receive_header(connection)
            publication = self._publications.get(header.get("topic", ""))
            if publication is None:
                tcpros.send(connection, tcpros.packed({"error": f"{self.name} publishes no such topic"}))
                connection.close()
                return
            if wrong := tcpros.differences(header, publication.kind, publication.md5):
                self._complain(f"{publication.topic}: {wrong}")
            publication.accept(connection, header, {"callerid": self.name})
        except RosError:
            connection.close()

    def _complain(self, words: str) -> None:
        if not self._closed and words not in self.complaints:
            self.complaints.append(words)


def long(kind: str) -> str:
    """A type as rosbags writes it: `sensor_msgs/msg/LaserScan`."""
    package, _, name = kind.partition("/")
    return f"{package}/msg/{name}"


def short(kind: str) -> str:
    """A type as ROS 1 writes it: `sensor_msgs/LaserScan`."""
    return kind.replace("/msg/", "/")
