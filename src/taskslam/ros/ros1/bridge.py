"""Between the rules of lockstep and a ROS 1 node: a master and a node of our own, and the foreign process."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from taskslam.errors import InputError, did_you_mean
from taskslam.robot import SensorRig
from taskslam.ros.bridge import CLOCK_TYPE, ROSOUT, TF_TYPE, US, Bridge, View
from taskslam.ros.errors import RosError
from taskslam.ros.node_file import CLOCK, TF, TF_STATIC, NodeFile
from taskslam.ros.process import NodeProcess
from taskslam.ros.ros1.master import Master
from taskslam.ros.ros1.node import Node, SlowSubscriberError, short
from taskslam.ros.ros1.xmlrpc import HERE, call
from taskslam.slam.base import StalledError

_US = f"/{US}"
_LOG_TYPE = "rosgraph_msgs/Log"
_WARN = 4  # rosgraph_msgs/Log


class Ros1Bridge(Bridge):
    """One life of a ROS 1 node. Raises InputError: it cannot be started, or its file does not fit the robot."""

    def __init__(self, node: NodeFile, rig: SensorRig) -> None:
        self._set: list[str] = []  # whole names of the parameters that the file sets
        self._master = Master()
        self._us = Node(_US, self._master.uri, node.patience)
        try:
            super().__init__(node, rig, self._us.store)
            self._set_parameters()
            self._open_topics()
            self._process = self._started()
        except BaseException:
            self.close()
            raise

    def findings(self) -> Iterator[str]:
        """What may be wrong with the node file, or with the node, though it answers: a sentence each."""
        yield from self._unused(self._view())
        asked = self._master.asked()
        for name in self._set:
            if not any(_within(name, one) or _within(one, name) for one in asked):
                unset = [one for one in asked if not self._master.parameters.has(one)]
                yield f"no node asked for the parameter {name}.{did_you_mean(name, unset)}"
        yield from self._frames()
        yield from self._us.complaints
        yield from self.warnings

    def close(self) -> None:
        """End the node, the connections and the master. Idempotent."""
        if self._process is not None:
            self._process.end()
        self._us.close()
        self._master.close()

    @property
    def _space(self) -> str:
        return f"/{self._file.name}/"

    def _set_parameters(self) -> None:
        self._master.parameters.set("/use_sim_time", True)
        for name, value in self._given().items():
            whole = name if name.startswith("/") else self._space + name
            self._set.append(whole)
            self._master.parameters.set(whole, value)

    def _open_topics(self) -> None:
        self._published = {
            topic: self._us.advertise(self._file.called(topic), short(kind)) for topic, kind in self._ours.items()
        }
        for topic, kind, latch in ((TF, TF_TYPE, False), (TF_STATIC, TF_TYPE, True), (CLOCK, CLOCK_TYPE, False)):
            self._published[topic] = self._us.advertise(topic, short(kind), latch)
        self._publish(TF_STATIC, self._mounts())
        self._us.subscribe(ROSOUT, _LOG_TYPE, self._log)
        self._us.subscribe(self._answers_on, short(self._answers_as), self._hear)

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

    def _connected(self) -> None:
        for name, api in self._master.graph().nodes.items():
            if name != _US:
                with suppress(RosError):
                    self._processes.add(call(api, "getPid", _US))
        if self._file.reset != "restart":
            try:
                self._us.call_service(self._file.reset)
            except RosError as error:
                raise InputError(f"reset by the service {self._file.reset}: {error}") from error

    def _view(self) -> View:
        graph = self._master.graph()
        publishers, readers = (
            {topic: others for topic, nodes in held.items() if (others := sorted(set(nodes) - {_US}))}
            for held in (graph.publishers, graph.subscribers)
        )
        return View(publishers, readers, dict(graph.types))

    def _unconnected(self, view: View) -> Iterator[str]:
        for publication in self._published.values():
            for name in view.readers.get(publication.topic, ()):
                if name not in publication.peers:
                    yield f"{name} has not connected to {publication.topic} yet"
        topic = self._answers_on
        if view.publishers.get(topic) and not self._us.publishers_of(topic):
            yield f"the publisher of {topic} has not answered yet"

    def _complaints(self) -> Sequence[str]:
        return self._us.complaints

    def _publish(self, topic: str, message: Any) -> None:
        try:
            self._published[topic].publish(message)
        except SlowSubscriberError as error:
            raise StalledError(f"{error}{self._warned()}") from error

    def _hear(self, publisher: str, data: bytearray) -> None:
        if publisher != _US:
            self._inbox.put((publisher, data))

    def _decode(self, data: bytes | bytearray) -> Any:
        return self._us.decode(short(self._answers_as), data)

    def _log(self, publisher: str, data: bytearray) -> None:
        with suppress(RosError):
            said = self._us.decode(_LOG_TYPE, data)
            if publisher != _US and said.level >= _WARN:
                self._warn(publisher, str(said.msg))


def _within(name: str, folder: str) -> bool:
    """Whether a parameter is the other, or stands in it."""
    return f"{name}/".startswith(f"{folder.rstrip('/')}/")
