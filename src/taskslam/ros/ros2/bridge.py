"""Between the rules of lockstep and a ROS 2 node: a bridge process in a domain of its own, and the foreign process.

Discovery has two directions: that we see a node does not say that it sees us. A node is connected once a service of its
own, its parameters', has answered a client that we made after all our topics: who knows of the last knows of all.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from taskslam.errors import InputError, did_you_mean
from taskslam.robot import SensorRig
from taskslam.ros.bridge import CLOCK_TYPE, ROSOUT, TF_TYPE, US, Bridge, View
from taskslam.ros.errors import NodeEndedError, RosError
from taskslam.ros.node_file import CLOCK, TF, TF_STATIC, NodeFile
from taskslam.ros.process import NodeProcess, session_of
from taskslam.ros.qos import LATCHED, Quality, mismatch
from taskslam.ros.ros2.bridge_process import in_humble
from taskslam.ros.ros2.client import End, Publication, Ros2
from taskslam.ros.ros2.domain import Domain

_US = f"/{US}"
_LOG_TYPE = "rcl_interfaces/msg/Log"
_WARN = 30  # rcl_interfaces/Log
_HANDSHAKE_S = 0.5
_ANSWER_S = 30.0  # s that a node at work, on a machine with other work, may take to tell of itself
_USUAL = Quality()


class Ros2Bridge(Bridge):
    """One life of a ROS 2 node. Raises InputError: it cannot be started, or its file does not fit the robot."""

    def __init__(self, node: NodeFile, rig: SensorRig) -> None:
        self._known: dict[str, bool] = {}  # nodes that have answered us, and whether they go by our clock
        self._untold: list[str] = []
        self._folder = TemporaryDirectory(prefix="ros2-", ignore_cleanup_errors=True)
        self._domain = Domain(Path(self._folder.name))
        setup = node.beside(node.setup) if node.setup else None
        try:
            self._ros = Ros2(US, setup, {**node.environment, **self._domain.variables})
        except BaseException:
            self._domain.close()
            self._folder.cleanup()
            raise
        try:
            super().__init__(node, rig, self._ros.store)
            self._open_topics()
            self._process = self._started(setup)
        except BaseException:
            self.close()
            raise

    def findings(self) -> Iterator[str]:
        """What may be wrong with the node file, or with the node, though it answers: a sentence each."""
        with suppress(RosError):
            view = self._view()
            yield from self._unused(view)
            yield from super()._unfit(view)
            yield from self._mismatches([held.topic for held in self._published.values()])
            yield from self._undeclared()
        for name, by_our_clock in self._known.items():
            if not by_our_clock:
                yield f"{name} has set use_sim_time to false: it goes by the wall's clock"
        yield from self._untold
        yield from self._frames()
        yield from self._ros.complaints
        yield from self.warnings

    def close(self) -> None:
        """End the node and the bridge, and remove what they left in shared memory. Idempotent."""
        if self._process is not None:
            self._process.end()
        self._ros.close()
        self._domain.close()
        self._folder.cleanup()

    def _open_topics(self) -> None:
        file, ros = self._file, self._ros
        self._published: dict[str, Publication] = {}
        try:
            for topic, kind in self._ours.items():
                self._published[topic] = ros.advertise(file.called(topic), kind, self._quality(file.called(topic)))
            self._published[CLOCK] = ros.advertise(CLOCK, CLOCK_TYPE, self._quality(CLOCK))
            for topic, usual in ((TF, Quality()), (TF_STATIC, LATCHED)):
                try:
                    self._published[topic] = ros.advertise(topic, TF_TYPE, self._quality(topic, usual))
                except RosError as error:
                    if self._answers_on == TF:
                        raise
                    self._untold.append(f"nothing is said on {topic}: {error}")
            self._publish(TF_STATIC, self._mounts())
            ros.subscribe(ROSOUT, _LOG_TYPE, LATCHED, self._log)
            asked = self._quality(self._answers_on)
            self._answer_number = ros.subscribe(self._answers_on, self._answers_as, asked, self._hear)
        except RosError as error:
            raise InputError(str(error)) from error

    def _quality(self, topic: str, usual: Quality = _USUAL) -> Quality:
        return self._file.qos.get(topic, usual)

    def _started(self, setup: str | None) -> NodeProcess:
        file, folder = self._file, Path(self._folder.name)
        parameters = folder / "parameters.yaml"
        given = {"use_sim_time": True, **self._given()}
        said = json.dumps({"/**": {"ros__parameters": given}})  # which is YAML, and text in it is text: "nan", "on"
        parameters.write_text(said, encoding="utf-8")
        remaps = [f"{from_}:={to}" for from_, to in {"__node": file.name, **file.remaps}.items()]
        words = ["--ros-args", "--params-file", str(parameters), *(part for one in remaps for part in ("-r", one))]
        variables = {"PYTHONUNBUFFERED": "1", **file.environment, **self._domain.variables}
        if self._ros.facts["distribution"] == "humble":
            variables = in_humble(variables)
        return NodeProcess([*file.arguments, *words], setup, variables, ours=setup is None)

    def _connected(self) -> None:
        self._processes.update(session_of(self._node.pid))
        if self._file.reset == "restart":
            return
        service = self._file.reset
        offered = self._ros.graph().services
        if service not in offered:
            raise InputError(f"nobody offers the service {service}.{did_you_mean(service, offered)}")
        try:
            self._ros.call(service, offered[service][0])
        except RosError as error:
            raise InputError(f"reset by the service {service}: {error}") from error

    def _fallen_silent(self) -> str:
        return super()._fallen_silent() or ("" if self._ros.alive else "the bridge to ROS 2 has ended")

    def _view(self) -> View:
        self._graph = graph = self._ros.graph()
        publishers, readers = (_others(ends) for ends in (graph.publishers, graph.subscribers))
        types = {topic: ends[0].type.replace("/msg/", "/") for topic, ends in (readers | publishers).items()}
        names = [{t: [end.node for end in ends] for t, ends in found.items()} for found in (publishers, readers)]
        return View(names[0], names[1], types)

    def _unfit(self, view: View) -> Iterator[str]:
        yield from super()._unfit(view)
        yield from self._mismatches([*self._awaited, self._answers_on])

    def _mismatches(self, topics: Collection[str]) -> Iterator[str]:
        """Where qualities of service of ours and of others do not fit, a sentence each."""
        for topic in topics:
            ours = self._quality(topic, LATCHED if topic == TF_STATIC else _USUAL)
            heard = topic == self._answers_on
            others = (self._graph.publishers if heard else self._graph.subscribers).get(topic, ())
            for end in others:
                pair = (end.quality, ours) if heard else (ours, end.quality)
                if end.node != _US and (why := mismatch(*pair)):
                    yield f"{topic} does not come through between us and {end.node}: {why}; say what fits under qos"

    def _unconnected(self, view: View) -> Iterator[str]:
        for held in self._published.values():
            readers = _others(self._graph.subscribers).get(held.topic, ())
            fitting = [end for end in readers if not mismatch(held.quality, end.quality)]
            if len(fitting) > (self._ros.matched(held.number) if fitting else 0):
                yield f"{_names(fitting)} has not connected to {held.topic} yet"
        topic = self._answers_on
        speakers = _others(self._graph.publishers).get(topic, ())
        fitting = [end for end in speakers if not mismatch(end.quality, self._quality(topic))]
        if len(fitting) > (self._ros.matched(self._answer_number) if fitting else 0):
            yield f"the publisher of {topic} has not answered yet"
        for name in dict.fromkeys(name for topic in self._awaited for name in view.readers.get(topic, ())):
            if name not in self._known and f"{name}/get_parameters" in self._graph.services:
                try:
                    self._known[name] = self._goes_by_our_clock(name)
                except RosError:
                    yield f"{name} has not answered yet"

    def _goes_by_our_clock(self, name: str) -> bool:
        """What its parameter says. Raises RosError: it does not answer at once."""
        told = self._ros.call(
            f"{name}/get_parameters", "rcl_interfaces/srv/GetParameters", {"names": ["use_sim_time"]}, _HANDSHAKE_S
        )
        return any(value["bool_value"] for value in told["values"])

    def _undeclared(self) -> Iterator[str]:
        """Parameters of the file that no node has, a sentence each."""
        given = list(_flat(self._given()))
        if not (given and self._known):
            return
        declared: set[str] = set()
        for name in self._known:
            try:
                told = self._ros.call(f"{name}/list_parameters", "rcl_interfaces/srv/ListParameters", {}, _ANSWER_S)
            except RosError:
                yield f"{name} does not say which parameters it has, so those of the file could not be looked at"
                return
            declared.update(told["result"]["names"])
        unset = sorted(declared - set(given))
        for name in given:
            if name not in declared:
                yield f"the node has no parameter {name}.{did_you_mean(name, unset)}"

    def _complaints(self) -> Sequence[str]:
        return self._ros.complaints

    def _publish(self, topic: str, message: Any) -> None:
        if held := self._published.get(topic):
            try:
                held.publish(message)
            except RosError as error:
                raise NodeEndedError(str(error)) from error

    def _hear(self, data: bytes) -> None:
        self._inbox.put(("", data))

    def _decode(self, data: bytes | bytearray) -> Any:
        return self._ros.decode(self._answers_as, data)

    def _log(self, data: bytes) -> None:
        with suppress(RosError):
            said = self._ros.decode(_LOG_TYPE, data)
            if said.level >= _WARN:
                self._warn(f"/{said.name}", str(said.msg))


def _others(ends: Mapping[str, tuple[End, ...]]) -> dict[str, tuple[End, ...]]:
    """Those ends that are not ours, where there are any."""
    return {topic: others for topic, held in ends.items() if (others := tuple(e for e in held if e.node != _US))}


def _names(ends: Iterable[End]) -> str:
    return " and ".join(sorted({end.node for end in ends}))


def _flat(parameters: Mapping[str, Any], above: str = "") -> Iterator[str]:
    """Names of all values, folders before them with a dot."""
    for key, value in parameters.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{above}{key}.")
        else:
            yield above + key
