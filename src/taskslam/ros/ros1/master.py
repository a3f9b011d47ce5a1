"""A ROS 1 master of our own: who publishes, who subscribes, which services, and the parameters. One a run.

It also remembers which parameters were asked for, so that one that nobody asked for can be told from one that is used.
Source of the functions: wiki.ros.org/ROS/Master_API and /ROS/Parameter Server API.
"""

from __future__ import annotations

import copy
import os
import threading
from collections import defaultdict
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from taskslam.ros.errors import RosError
from taskslam.ros.ros1.parameters import Parameters
from taskslam.ros.ros1.tcpros import ANY
from taskslam.ros.ros1.xmlrpc import Server, call

_NAME = "/master"
Registered = dict[str, dict[str, str]]  # by topic or service: by node, its address


@dataclass
class Graph:
    """Who does what: nodes' addresses by topic (or service) and name; the types of topics."""

    publishers: Registered = field(default_factory=lambda: defaultdict(dict))
    subscribers: Registered = field(default_factory=lambda: defaultdict(dict))
    services: Registered = field(default_factory=lambda: defaultdict(dict))
    types: dict[str, str] = field(default_factory=dict)
    nodes: dict[str, str] = field(default_factory=dict)


class Master:
    """Serves until it is closed. uri: of the server."""

    def __init__(self) -> None:
        self._graph = Graph()
        self._asked: set[str] = set()
        self.parameters = Parameters()
        self._listeners: Registered = defaultdict(dict)
        self._lock = threading.RLock()
        self._tellers: dict[str, ThreadPoolExecutor] = {}
        self._server = Server(self)
        self.uri = self._server.uri

    def close(self) -> None:
        """Serve no more; nodes are told nothing."""
        self._server.close()
        with self._lock:
            for teller in self._tellers.values():
                teller.shutdown(wait=False, cancel_futures=True)

    def graph(self) -> Graph:
        """As it is now."""
        with self._lock:
            return copy.deepcopy(self._graph)

    def asked(self) -> set[str]:
        """The parameters that were asked for so far, by whole names."""
        with self._lock:
            return set(self._asked)

    def functions(self) -> Mapping[str, Any]:
        """Of the master and of the parameter server, each under one lock."""
        names = (
            *("registerService", "unregisterService", "registerSubscriber", "unregisterSubscriber"),
            *("registerPublisher", "unregisterPublisher", "lookupNode", "lookupService", "getPublishedTopics"),
            *("getTopicTypes", "getSystemState", "getUri", "getPid", "deleteParam", "setParam", "getParam"),
            *("searchParam", "subscribeParam", "unsubscribeParam", "hasParam", "getParamNames"),
        )
        return {name: self._locked(getattr(self, f"_{_snake(name)}")) for name in names}

    def _locked(self, function: Any) -> Any:
        def called(*arguments: Any) -> Any:
            with self._lock:
                return function(*arguments)

        return called

    def _register_publisher(self, node: str, topic: str, kind: str, api: str) -> list[str]:
        graph = self._graph
        self._meet(node, api)
        if kind != ANY or topic not in graph.types:  # who publishes knows better than who would like to hear
            graph.types[topic] = kind
        graph.publishers[topic][node] = api
        self._tell_subscribers(topic)
        return list(graph.subscribers[topic].values())

    def _unregister_publisher(self, node: str, topic: str, api: str) -> int:
        gone = _forget(self._graph.publishers, topic, node, api)
        if gone:
            self._tell_subscribers(topic)
        return gone

    def _register_subscriber(self, node: str, topic: str, kind: str, api: str) -> list[str]:
        graph = self._graph
        self._meet(node, api)
        graph.types.setdefault(topic, kind)
        graph.subscribers[topic][node] = api
        return list(graph.publishers[topic].values())

    def _unregister_subscriber(self, node: str, topic: str, api: str) -> int:
        return _forget(self._graph.subscribers, topic, node, api)

    def _register_service(self, node: str, service: str, address: str, api: str) -> int:
        self._meet(node, api)
        self._graph.services[service] = {node: address}
        return 1

    def _unregister_service(self, node: str, service: str, address: str) -> int:
        return _forget(self._graph.services, service, node, address)

    def _lookup_service(self, node: str, service: str) -> str:  # noqa: ARG002
        for address in self._graph.services.get(service, {}).values():
            return address
        raise RosError(f"no provider of the service {service}")

    def _lookup_node(self, node: str, wanted: str) -> str:  # noqa: ARG002
        if wanted not in self._graph.nodes:
            raise RosError(f"unknown node [{wanted}]")
        return self._graph.nodes[wanted]

    def _get_published_topics(self, node: str, below: str) -> list[list[str]]:  # noqa: ARG002
        graph, prefix = self._graph, below.rstrip("/") + "/"
        return [
            [topic, graph.types[topic]] for topic, by in graph.publishers.items() if by and topic.startswith(prefix)
        ]

    def _get_topic_types(self, node: str) -> list[list[str]]:  # noqa: ARG002
        return [[topic, kind] for topic, kind in self._graph.types.items()]

    def _get_system_state(self, node: str) -> list[list[Any]]:  # noqa: ARG002
        graph = self._graph
        return [
            [[name, list(by)] for name, by in registered.items() if by]
            for registered in (graph.publishers, graph.subscribers, graph.services)
        ]

    def _get_uri(self, node: str) -> str:  # noqa: ARG002
        return self.uri

    def _get_pid(self, node: str) -> int:  # noqa: ARG002
        return os.getpid()

    def _set_param(self, node: str, name: str, value: Any) -> int:
        whole = _whole(node, name)
        self.parameters.set(whole, value)
        for key, listeners in self._listeners.items():
            if f"{whole}/".startswith(f"{key}/") or f"{key}/".startswith(f"{whole}/"):
                now = self._value_or_nothing(key)
                for api in listeners.values():
                    self._tell(api, "paramUpdate", key + "/" * isinstance(now, dict), now)
        return 0

    def _get_param(self, node: str, name: str) -> Any:
        return self.parameters.get(self._asking(_whole(node, name)))

    def _has_param(self, node: str, name: str) -> bool:
        return self.parameters.has(self._asking(_whole(node, name)))

    def _delete_param(self, node: str, name: str) -> int:
        self.parameters.delete(_whole(node, name))
        return 0

    def _search_param(self, node: str, key: str) -> str:
        found = self.parameters.search(node, key)
        self._asking(found)
        return found

    def _subscribe_param(self, node: str, api: str, name: str) -> Any:
        whole = self._asking(_whole(node, name))
        self._listeners[whole][node] = api
        return self._value_or_nothing(whole)

    def _unsubscribe_param(self, node: str, api: str, name: str) -> int:
        return _forget(self._listeners, _whole(node, name), node, api)

    def _get_param_names(self, node: str) -> list[str]:  # noqa: ARG002
        return self.parameters.names()

    def _asking(self, name: str) -> str:
        self._asked.add(name)
        return name

    def _value_or_nothing(self, name: str) -> Any:
        return self.parameters.get(name) if self.parameters.has(name) else {}

    def _meet(self, node: str, api: str) -> None:
        """Know a node by its name; the one that bore it before is asked to go."""
        before = self._graph.nodes.get(node)
        self._graph.nodes[node] = api
        if before is not None and before != api:
            for registered in (self._graph.publishers, self._graph.subscribers):
                for topic in registered:
                    _forget(registered, topic, node, before)
            self._tell(before, "shutdown", f"new node registered with same name [{node}]")

    def _tell_subscribers(self, topic: str) -> None:
        publishers = list(self._graph.publishers[topic].values())
        for api in self._graph.subscribers[topic].values():
            self._tell(api, "publisherUpdate", topic, publishers)

    def _tell(self, api: str, function: str, *arguments: Any) -> None:
        """In order, and without waiting: a node that hangs holds up nobody else."""
        if api not in self._tellers:
            self._tellers[api] = ThreadPoolExecutor(1, thread_name_prefix="master")
        with suppress(RuntimeError):  # it is being closed
            self._tellers[api].submit(_told, api, function, *arguments)


def _told(api: str, function: str, *arguments: Any) -> None:
    with suppress(RosError):  # a node that is gone need not know
        call(api, function, _NAME, *arguments)


def _forget(registered: Registered, name: str, node: str, address: str) -> int:
    """Take an entry away if it is this very one; how many were."""
    if registered.get(name, {}).get(node) != address:
        return 0
    del registered[name][node]
    return 1


def _whole(node: str, name: str) -> str:
    """The whole name of one that a node gives: its own (~), of its namespace, or whole already."""
    if name.startswith("~"):
        name = f"{node}/{name[1:]}"
    elif not name.startswith("/"):
        name = f"{node.rpartition('/')[0]}/{name}"
    return "/" + "/".join(part for part in name.split("/") if part)


def _snake(name: str) -> str:
    return "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name)
